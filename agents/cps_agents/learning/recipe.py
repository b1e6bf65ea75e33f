"""Everything that decides how a policy is trained, and recipes as files keep them.

A file may have been written before a knob was added.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

from cps_agents.arena.venue import Venue
from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_envs.core.declare.training import Training
from cps_envs.core.errors import near
from cps_envs.core.types import SIGN, Array, FloatArray, Role, other
from cps_envs.registration import find_problem


@dataclass(frozen=True)
class Situation:
    """A part of the episodes that judge a candidate; what is empty here is the recipe's."""

    episodes: int
    opponent: str = ""
    preset: str = ""
    overrides: Mapping[str, Any] = field(default_factory=dict)  # on top of the recipe's


def count_episodes(scenes: Sequence[Situation]) -> int:
    """How many episodes judge a candidate."""
    return sum(scene.episodes for scene in scenes)


SEARCH = "cma-es"
LEAST_POPULATION = 4
SHARED = "shared-ppo"  # our own, see `learning.ppo`: a network for all agents of a role
ALGORITHMS = (SHARED, SEARCH)
UNBOUNDED = 10**9  # steps, of learning that only CPU time ends


USUAL = Training(total_timesteps=1_000_000)


@dataclass(frozen=True)
class Ppo:
    """Settings of our own PPO; what stable-baselines3's PPO has too is called as there.

    Raises:
        CommandError: a value that makes no sense.
    """

    hidden: tuple[int, ...] = (64, 64)  # units of the layers, of policy and value each
    neutral_bias: float = 0.0  # added to the first logits of the neutral action
    initial_deviation: float = 0.3  # of the first continuous actions
    n_steps: int = 64  # of each environment, between updates
    rows_per_update: int = 20_000  # at most, drawn from all decisions since the last update
    batch_size: int = 4096
    n_epochs: int = 4  # over the rows of an update
    learning_rate: float = 1e-3
    final_learning_rate: float = 1e-4  # reached linearly
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    vf_coef: float = 0.5
    value_warm_up: int = 0  # updates of the value alone before the policy that learning begins with may change
    target_kl: float = 0.03  # an update ends beyond it, from the second epoch on; 0: never
    max_grad_norm: float = 0.5
    copies: int = 1  # above 1 every episode is played so often, and what differs is learned from, see `learning.copies`
    episode_noise: bool = False  # learn by noise that is held for an episode, see `learning.episode_noise`
    bias_learning_rate: float = 0.08  # of the last layer's bias, with `episode_noise`

    def __post_init__(self) -> None:
        check_counts(self, "n_steps", "batch_size", "n_epochs", "copies")
        if not 0 < self.gamma <= 1 or self.learning_rate <= 0:
            raise CommandError("gamma has to lie in (0, 1], learning_rate above 0")
        if len(set(self.hidden)) != 1 or len(self.hidden) != 2:
            raise CommandError(f"the network has two hidden layers of one size, not {list(self.hidden)}")


def check_counts(held: Any, *names: str) -> None:
    """Check that these fields are at least 1.

    Raises:
        CommandError: one is not.
    """
    for name in names:
        if getattr(held, name) < 1:
            raise CommandError(f"{name} = {getattr(held, name)} has to be at least 1")


@dataclass(frozen=True)
class Recipe:
    """The knobs of a training run; a recipe of a problem and role gives its own values with its reasons.

    Knobs are its fields and those of `training` and `ppo`, whose names differ. A step of shared-ppo is a decision that
    the role could take, in one episode, also where an action is kept. A step of cma-es is an episode.

    Raises:
        CommandError: a value that makes no sense.
    """

    name: str = ""  # of the trained policy
    problem: str = ""
    role: Role = "attacker"
    algorithm: str = SHARED
    preset: str = "learning"
    overrides: Mapping[str, Any] = field(default_factory=dict)  # of the preset's fields
    training: Training = USUAL  # its `ppo` is not used; without an opponent it is the preset's own
    ppo: Ppo = Ppo()

    most_cpu_s: float = 0.0  # a run ends early after so many CPU seconds, which no two runs do alike; 0: never
    evaluations: int = 10  # in the course of a run, on validation seeds
    evaluation_episodes: int = 32
    evaluation_metric: str = "return"  # what chooses the best checkpoint
    start: str = ""  # a trained policy, zoo:NAME, with whose weights learning begins; random ones if empty

    family: str = ""  # of policies whose numbers are searched by cma-es
    population: int = 14  # candidates in a generation
    search_deviation: float = 0.4  # of the first generation, in the steps of the family's numbers
    scenes: tuple[Situation, ...] = (Situation(16),)  # what judges a candidate

    def __post_init__(self) -> None:
        if self.algorithm not in ALGORITHMS:
            raise CommandError(f"there is no algorithm {self.algorithm!r}. {near(self.algorithm, ALGORITHMS)}")
        check_counts(self, "evaluation_episodes")
        check_counts(self.training, "frame_skip", "total_timesteps", "num_envs")
        if self.population < LEAST_POPULATION or self.search_deviation <= 0 or not self.scenes:
            raise CommandError(
                f"population has to be at least {LEAST_POPULATION}, search_deviation above 0, scenes at least one"
            )

    @property
    def venue(self) -> Venue:
        """The configuration that the policy trains in."""
        return Venue(self.problem, self.preset, dict(self.overrides))

    @property
    def rival(self) -> str:
        """Whom it trains against: the opponent, or the preset's own one."""
        return self.training.opponent or find_problem(self.problem).opponents[self.preset][other(self.role)]

    @property
    def budget(self) -> int:
        """What its progress counts up to: steps, or the CPU seconds of learning that only these end."""
        steps = self.training.total_timesteps
        return steps if steps < UNBOUNDED else math.ceil(self.most_cpu_s)

    def values(self, outcome: Mapping[str, Array]) -> FloatArray:
        """What episodes that end with `outcome`, (B,) each, are worth; training and search look for the highest."""
        worth: FloatArray = SIGN[self.role] * outcome[self.evaluation_metric]
        return worth

    def score(self, outcome: Mapping[str, Array]) -> float:
        """What chooses the best checkpoint, the higher the better, from what validation episodes end with (B,) each."""
        return float(self.values(outcome).mean())


PARTS: Mapping[str, type] = {"training": Training, "ppo": Ppo}  # fields whose own fields are knobs
UNUSED = "ppo"  # of a training: other libraries' settings


def homes() -> dict[str, str]:
    """Where each knob lies: a field of a recipe, or empty for the recipe itself."""
    own = {entry.name: "" for entry in fields(Recipe) if entry.name not in PARTS}
    return own | {each.name: part for part, kind in PARTS.items() for each in fields(kind) if each.name != UNUSED}


def changed(recipe: Recipe, values: Mapping[str, Any]) -> Recipe:
    """The recipe with some knobs set otherwise.

    Raises:
        CommandError: no such knob, or a value of another type.
    """
    known = homes() | {entry.name: "" for entry in fields(recipe) if entry.name not in PARTS}
    fitting: dict[str, dict[str, Any]] = {part: {} for part in ("", *PARTS)}
    for name, value in values.items():
        if name not in known:
            raise CommandError(f"a recipe has no knob {name!r}. {near(name, known)}")
        held = getattr(recipe, known[name]) if known[name] else recipe
        fitting[known[name]][name] = _scenes(value) if name == "scenes" else _fitting(name, value, getattr(held, name))
    parts = {part: replace(getattr(recipe, part), **fitting[part]) for part in PARTS if fitting[part]}
    return replace(recipe, **fitting[""], **parts)


def _fitting(name: str, value: Any, present: Any) -> Any:
    if isinstance(present, tuple) and isinstance(value, list):
        return tuple(value)
    if isinstance(present, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(present, Mapping) and isinstance(value, Mapping):
        return {**present, **value}
    if type(value) is not type(present):
        raise CommandError(f"{name} = {value!r} should be like {present!r}")
    return value


def _scenes(value: Any) -> tuple[Situation, ...]:
    """Scenes as JSON has them: `[{"episodes": 16, "opponent": "lead"}]`.

    Raises:
        CommandError: something else.
    """
    try:
        found = tuple(Situation(**scene) for scene in value)
    except TypeError as error:
        raise CommandError(f'scenes should be like [{{"episodes": 16, "opponent": "lead"}}], got {value!r}') from error
    if not all(type(scene.episodes) is int and scene.episodes > 0 for scene in found):
        raise CommandError("every scene needs a whole number of episodes, at least 1")
    return found


def knobs_of(recipe: Recipe) -> dict[str, Any]:
    """Every knob by its name, as a JSON file has it."""
    found: dict[str, Any] = json.loads(to_json(asdict(recipe)))
    parts = [found.pop(part) for part in PARTS]
    return found | {name: value for part in parts for name, value in part.items() if name != UNUSED}


def differing(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Knobs in which two kept recipes differ; one that a file does not have yet stands at its default."""
    usual = knobs_of(Recipe())
    ours, theirs = {**usual, **first}, {**usual, **second}
    return sorted(name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name))
