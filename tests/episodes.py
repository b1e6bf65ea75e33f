"""Episodes of any problem for the tests; tests of one problem take them as `partial(play, PROBLEM)`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cps_envs.core.play import play_episodes
from cps_envs.core.policy import RoleSpec
from cps_envs.core.problem import Problem
from cps_envs.core.types import Array, Role


def started(problem: Problem, seeds: Sequence[int] = (0,), preset: str = "paper", **overrides: Any) -> Any:
    """A game with an environment for each seed, reset."""
    game = problem.game(problem.config(preset, overrides), len(seeds))
    game.reset(np.ones(len(seeds), bool), [np.random.default_rng(seed) for seed in seeds])
    return game


def spec_of(problem: Problem, role: Role, preset: str = "paper", **overrides: Any) -> RoleSpec:
    """The interface of a role."""
    return problem.game(problem.config(preset, overrides), 1).spec(role)


def play(
    problem: Problem,
    attacker: Any,
    defender: Any = "none",
    seeds: Sequence[int] = (0,),
    preset: str = "paper",
    on_step: Callable[..., Any] | None = None,
    **overrides: Any,
) -> dict[str, Array]:
    """The outcome of an episode per seed."""
    players = {"attacker": attacker, "defender": defender}
    return play_episodes(problem, problem.config(preset, overrides), players, seeds, on_step=on_step)


def watched(
    problem: Problem,
    see: Callable[[Any], Any],
    attacker: Any = "none",
    defender: Any = "none",
    seeds: Sequence[int] = (0,),
    preset: str = "paper",
    **overrides: Any,
) -> list[Any]:
    """What `see` finds in the game at the start of the episodes and after each decision."""
    found: list[Any] = []
    play(problem, attacker, defender, seeds, preset, lambda game: found.append(see(game)), **overrides)
    return found
