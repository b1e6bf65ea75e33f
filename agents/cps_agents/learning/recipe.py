"""Everything that decides how a policy is trained, and recipes as files keep them.

A file may have been written before a knob was added.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_envs.core.errors import near
from cps_envs.core.types import SIGN, Array, BoolArray, FloatArray, Role

if TYPE_CHECKING:
    from cps_envs.core.game import Game


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
IMITATION = "recurrent-imitation"
RECURRENT = ("recurrent-ppo", IMITATION)
SHARED = "shared-ppo"  # our own, see `learning.ppo`: a network for all agents of a role
ALGORITHMS = (SHARED, "ppo", "maskable-ppo", *RECURRENT, "sac", "dqn", SEARCH)
ACTIVATIONS = ("tanh", "relu")
LOSSES = ("squared", "logistic")
UNBOUNDED = 10**9  # steps, of learning that only CPU time ends


@dataclass(frozen=True)
class Recipe:
    """The knobs of a training run; a recipe of a problem and role gives its own values with its reasons.

    A step is one decision of one agent: `num_envs` of them, in the swarm form times the agents, are made at once. Of
    shared-ppo it is a decision that the role could take, in one episode, also where an action is kept.

    Raises:
        CommandError: a value that makes no sense.
    """

    name: str = ""  # of the trained policy
    problem: str = ""
    role: Role = "attacker"
    algorithm: str = "ppo"
    opponent: str = ""  # a policy's name; the preset's own if empty
    preset: str = "learning"
    overrides: Mapping[str, Any] = field(default_factory=dict)  # of the preset's fields
    swarm: bool = False  # one network for all agents of the role's team, each with its own sensors and reward
    unseen: tuple[str, ...] = ()  # fields of the observation that the network does not get
    focus: Mapping[str, float] = field(default_factory=dict)  # units of fields whose values near zero tell most
    hold: int = 1  # decisions of the environment that an action is kept for
    played_hold: int = 0  # the same where the trained network plays, which may look more often; 0: as `hold`
    bootstrap: bool = False  # value what would come after the last step; for observations that do not tell the time
    reward_scale: float = 1.0  # rewards are multiplied with this; returns of about 1 to 10 are easiest

    total_steps: int = 1_000_000  # of recurrent-imitation: decisions that the teacher labels
    most_cpu_s: float = 0.0  # a run ends early after so many CPU seconds, which no two runs do alike; 0: never
    num_envs: int = 64
    steps_per_update: int = 128  # of each environment (PPO)
    batch_size: int = 2048
    epochs: int = 4  # over the steps of an update (PPO)
    learning_rate: float = 3e-4
    final_learning_rate: float = 0.0  # reached linearly
    discount: float = 0.995
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    entropy_bonus: float = 0.0
    value_weight: float = 0.5
    target_kl: float = 0.0  # an update ends early beyond 1.5 times this; 0: never
    max_grad_norm: float = 0.5

    hidden: tuple[int, ...] = (64, 64)  # units of the layers, of policy and value each
    memory_units: int = 64  # of the LSTM (recurrent-ppo, recurrent-imitation)
    activation: str = "tanh"
    initial_deviation: float = 0.5  # of Gaussian actions
    neutral_bonus: float = 0.0  # added to the first logits of the neutral action, for roles that should mostly wait

    adapter: str = "native"  # what shared-ppo plays the role through, and below the rest that only it has
    recent_s: tuple[float, ...] = ()  # s, time constants of running averages of the inputs
    rough_s: float = 0.0  # s, that of a running average of their changes; 0: none
    run_s: float = 0.0  # s, for which an untrained policy repeats an action on average; 0: draws each anew
    pay_power: float = 1.0  # below 1 the increase of this power of what was paid so far is learned from
    relative: bool = False  # learn from what is gained over the neutral action in the same, second episode
    rows_per_update: int = 20_000  # at most, drawn from all decisions since the last update
    episode_noise: bool = False  # learn by noise that is held for an episode, see `learning.episode_noise`
    twins: bool = False  # play every episode twice, and learn from the difference, see `learning.twins`
    bias_learning_rate: float = 0.08  # of the last layer's bias, with `episode_noise`
    sampled: bool = False  # draw actions where the trained policy plays, instead of the most likely ones
    start: str = ""  # a trained policy, zoo:NAME, with whose weights learning begins; random ones if empty

    buffer_size: int = 300_000  # SAC, DQN
    learning_starts: int = 10_000
    updates_per_step: float = 0.1  # gradient steps for each step of all environments together (SAC, DQN)
    exploration_share: float = 0.3  # of the run in which DQN's random moves fade out

    teacher: str = ""  # an analytic policy that the network imitates first
    teachers: Mapping[str, str] = field(default_factory=dict)  # instead: for each opponent the teacher against it
    variations: tuple[
        Mapping[str, Any], ...
    ] = ()  # further overrides, among which taught and validated episodes divide
    teacher_loss: str = "squared"  # for continuous actions; "logistic" for those that are mostly at their bounds
    teacher_episodes: int = 64  # in a round
    teacher_rounds: int = 1  # from the second on the network plays and the teacher says what it would have done
    teacher_noise: float = 0.0  # deviation of what disturbs the actions that a teacher plays, to show how to recover
    teacher_epochs: int = 20  # over all demonstrations, in a round
    value_warm_up: int = 0  # updates of the value alone before the policy that learning begins with may change

    family: str = ""  # of policies whose numbers are searched (CMA-ES, of which a step is an episode)
    population: int = 14  # candidates in a generation
    search_deviation: float = 0.4  # of the first generation, in the steps of the family's numbers
    scenes: tuple[Situation, ...] = (Situation(16),)  # what judges a candidate

    search_steps: int = 0  # of a search for plans that the network imitates first; for few, deterministic starts
    self_imitation: int = 0  # steps, before each update (PPO), towards the own best episode of every start

    evaluations: int = 10  # in the course of a run, on validation seeds
    evaluation_episodes: int = 32
    evaluation_metric: str = "return"  # what chooses the best checkpoint

    def __post_init__(self) -> None:
        if self.algorithm not in ALGORITHMS:
            raise CommandError(f"there is no algorithm {self.algorithm!r}. {near(self.algorithm, ALGORITHMS)}")
        counts = ("hold", "total_steps", "num_envs", "steps_per_update", "batch_size", "epochs", "evaluation_episodes")
        for name in counts:
            if getattr(self, name) < 1:
                raise CommandError(f"{name} = {getattr(self, name)} has to be at least 1")
        if self.population < LEAST_POPULATION or self.search_deviation <= 0 or not self.scenes:
            raise CommandError(
                f"population has to be at least {LEAST_POPULATION}, search_deviation above 0, scenes at least one"
            )
        if not 0 < self.discount <= 1 or self.learning_rate <= 0 or self.reward_scale <= 0:
            raise CommandError("discount has to lie in (0, 1], learning_rate and reward_scale above 0")
        if self.activation not in ACTIVATIONS:
            raise CommandError(f"there is no activation {self.activation!r}. {near(self.activation, ACTIVATIONS)}")
        if self.teacher_loss not in LOSSES:
            raise CommandError(f"teacher_loss = {self.teacher_loss!r} is not one of {', '.join(LOSSES)}")
        if self.algorithm == IMITATION and not self.taught:
            raise CommandError(f"{IMITATION} needs a teacher: add --knob teacher=NAME, a policy of the {self.role}")
        if self.algorithm == SHARED and (self.taught or self.search_steps or self.swarm or self.unseen):
            raise CommandError(
                f"{SHARED} learns by reward alone, through an adapter: no teacher, search, swarm, unseen"
            )
        if self.algorithm == SHARED and (len(set(self.hidden)) != 1 or len(self.hidden) != 2):
            raise CommandError(f"{SHARED} has two hidden layers of one size, not {list(self.hidden)}")
        if self.swarm and self.role != "defender":
            raise CommandError("only defenders have a swarm form")

    @property
    def budget(self) -> int:
        """What its progress counts up to: steps, or the CPU seconds of learning that only these end."""
        return self.total_steps if self.total_steps < UNBOUNDED else math.ceil(self.most_cpu_s)

    @property
    def taught(self) -> bool:
        """Whether the network begins with the imitation of a teacher."""
        return bool(self.teacher or self.teachers)

    def masks(self, game: Game) -> BoolArray | None:
        """What may be played (B, k) in training, None where everything may; a recipe may take away what is useless."""
        return game.action_mask(self.role)

    def learned(self, game: Game, rewards: FloatArray, ended: BoolArray) -> FloatArray:
        """The rewards (B,) to learn from instead of the agents' own; evaluations and reports keep those.

        A recipe that shapes them says why the best policy stays the best.
        """
        return rewards

    def values(self, outcome: Mapping[str, Array]) -> FloatArray:
        """What episodes that end with `outcome`, (B,) each, are worth, the higher the better: what is searched for."""
        worth: FloatArray = SIGN[self.role] * outcome[self.evaluation_metric]
        return worth

    def score(self, outcome: Mapping[str, Array]) -> float:
        """What chooses the best checkpoint, the higher the better, from what validation episodes end with (B,) each."""
        return float(self.values(outcome).mean())


def changed(recipe: Recipe, values: Mapping[str, Any]) -> Recipe:
    """The recipe with some knobs set otherwise.

    Raises:
        CommandError: no such knob, a value of another type, or an opponent that the recipe's teachers do not know.
    """
    known = {entry.name for entry in fields(recipe)}
    fitting: dict[str, Any] = {}
    for name, value in values.items():
        if name not in known:
            raise CommandError(f"a recipe has no knob {name!r}. {near(name, known)}")
        fitting[name] = _scenes(value) if name == "scenes" else _fitting(name, value, getattr(recipe, name))
    teachers = fitting.get("teachers", recipe.teachers)
    if teachers and (opponent := fitting.get("opponent")):
        if opponent not in teachers:
            raise CommandError(
                f"{recipe.name} has no teacher against {opponent!r}. {near(opponent, teachers)} Name one: "
                """--knob 'teachers={"OPPONENT":"TEACHER"}'"""
            )
        fitting["teachers"] = {opponent: teachers[opponent]}
    return replace(recipe, **fitting)


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
    """Every knob as a JSON file has it."""
    found: dict[str, Any] = json.loads(to_json(asdict(recipe)))
    return found


def differing(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Knobs in which two kept recipes differ; one that a file does not have yet stands at its default."""
    usual = knobs_of(Recipe())
    ours, theirs = {**usual, **first}, {**usual, **second}
    return sorted(name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name))
