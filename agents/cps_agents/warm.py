"""Compiling ahead what a first use would have to wait for: every preset, adapter and policy of a problem, briefly.

All interfaces are views of one simulator. What they need beyond it, a vector environment of each role needs, too.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_envs.core.compute.compiling import NOTICE, compiled, told
from cps_envs.core.compute.generators import seeded
from cps_envs.core.compute.kernel_cache import UNKEPT
from cps_envs.core.errors import ConfigurationError, MissingExtraError
from cps_envs.core.game.problem import Problem
from cps_envs.core.learning.outside import Outside
from cps_envs.core.policies.lookup import policy_names
from cps_envs.core.types import ROLES, Role

Overrides: TypeAlias = Mapping[str, Any]
DECISIONS = 3  # enough for kernels that run between decisions, and for an episode's end
ENVS = 2
CHEAP = {"ga": "ga?generations=1&population=4"}  # policies that search at the start of an episode


@dataclass(frozen=True)
class Visit:
    """A short use of a problem that compiles those of its kernels that are not compiled yet."""

    problem: str
    what: str
    play: Callable[[], None]


def visits(problem: Problem) -> Iterator[Visit]:
    """Everything of a problem that brings kernels of its own."""
    for preset in problem.presets:
        yield Visit(problem.name, preset, partial(_match, problem, preset, {}, problem.opponents[preset]))
    for role in ROLES:
        if (env_id := problem.env_id(role)) in gymnasium.registry:  # a problem of one's own may have none
            yield Visit(problem.name, f"{role}, vector", partial(_vector, env_id))
        for name in problem.game(problem.config(next(iter(problem.presets)), {}), 1).adapters.get(role, {}):
            yield Visit(problem.name, f"{role} through {name}", partial(_adapter, problem, role, name))
    for name, value in _variants(problem):
        yield Visit(problem.name, f"{name}={value}", partial(_try, problem, {name: value}))
    for role in ROLES:
        for name in policy_names(problem.name, role):
            yield Visit(problem.name, f"{role} {name}", partial(_policy, problem, role, CHEAP.get(name, name)))
    for name in shipped_names():
        card = read_card(SHIPPED / f"{name}.json")
        if card.problem == problem.name:
            played = partial(_match, problem, card.preset, card.overrides, {card.role: f"zoo:{name}"})
            yield Visit(problem.name, f"{card.role} zoo:{name}", played)


def _variants(problem: Problem) -> Iterator[tuple[str, str]]:
    """Each choice of each field of the configuration that is a word; other forms of actions have other kernels."""
    for field in dataclasses.fields(problem.presets[next(iter(problem.presets))]):
        if isinstance(field.default, str):
            yield from ((field.name, choice) for choice in field.metadata.get("choices", ()) if choice != field.default)


def _try(problem: Problem, overrides: Overrides) -> None:
    """Play a configuration, if it is one: a field may ask for another one."""
    try:
        first = next(iter(problem.presets))
        _match(problem, first, overrides, problem.opponents[first])
    except ConfigurationError:
        return


def _policy(problem: Problem, role: Role, name: str) -> None:
    """Play a policy against the usual opponent in the first preset that it fits."""
    for preset in problem.presets:
        try:
            return _match(problem, preset, {}, {**problem.opponents[preset], role: name})
        except (ConfigurationError, MissingExtraError, TypeError):
            continue  # it needs options, another configuration, or a package that is not installed


def _match(problem: Problem, preset: str, overrides: Overrides, players: Mapping[Any, str]) -> None:
    """Play both roles from inside, and look at everything that both roles may see."""
    match = problem.match(problem.config(preset, overrides), ENVS, players)
    game, everyone = match.game, np.ones(ENVS, np.bool_)
    match.reset(everyone, seeded(range(ENVS)))
    for step in range(DECISIONS):
        envs = everyone if step == 0 else np.arange(ENVS) > 0  # also some of them
        match.step({}, envs, min(game.horizon // DECISIONS, max(game.decision_interval.values())))
        for role in ROLES:
            game.observe(role)
            game.action_mask(role)
    game.metrics()


def _adapter(problem: Problem, role: Role, name: str) -> None:
    """Play a role through an adapter in the first preset that it fits."""
    everyone = np.ones(ENVS, np.bool_)
    for config in problem.presets.values():
        game = problem.game(config, ENVS)
        try:
            outside = Outside(game, role, name)
        except ConfigurationError:
            continue
        game.reset(everyone, seeded(range(ENVS)))
        adapter, seen, state = outside.adapter, outside.seen(), outside.adapter.begin(ENVS)
        adapter.observe(seen, state)
        neutral = np.stack([np.stack([adapter.neutral_action] * len(outside.agents))] * ENVS)
        action, _ = outside.act(seen, state, neutral)
        outside.rewards(game.advance({role: action}, everyone, game.decision_interval[role]))
        return


def _vector(env_id: str) -> None:
    """Batches with both ways of starting anew, which they do after two decisions; then the form for learners."""
    for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
        envs: Any = gymnasium.make_vec(
            env_id, ENVS, "vector_entry_point", interface="native", autoreset=mode, max_episode_steps=2
        )
        _, info = envs.reset(seed=0)
        neutral = np.stack([envs.game.neutral_action[envs.role]] * ENVS)
        for _ in range(DECISIONS + 1):
            envs.step(neutral if "action_mask" in info else envs.action_space.sample())
        envs.close()
    learning = gymnasium.make_vec(env_id, ENVS, "vector_entry_point")
    learning.reset(seed=0)
    learning.step(learning.action_space.sample())
    learning.close()


@dataclass
class Warmed:
    """What warming a problem came to."""

    problem: str
    uses: int = 0
    compiled: int = 0  # kernels; 0 where all of them were there
    cpu_s: float = 0.0
    failed: list[str] = dataclasses.field(default_factory=list)  # uses that ended with an error, and the error
    kept: bool = True  # in a folder, for later processes


def warm(problem: str, uses: Sequence[Visit], report: Callable[[Visit], None] = lambda visit: None) -> Warmed:
    """Make visits to a problem; a failure is noted and the next visit can go on."""
    told.add(NOTICE)  # whoever asks for this knows what happens
    found = Warmed(problem)
    for visit in uses:
        report(visit)
        before, start = len(compiled), time.process_time()
        try:
            visit.play()
        except Exception as error:
            found.failed.append(f"{visit.what}: {type(error).__name__}: {error}")
        found.uses += 1
        found.compiled += len(compiled) - before
        found.cpu_s += time.process_time() - start
    found.kept = UNKEPT not in told
    return found
