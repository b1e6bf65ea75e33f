"""Whole episodes between two policies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import gcd
from typing import Any

import numpy as np

from cps_envs.core.compute.generators import seeded
from cps_envs.core.game.game import Game
from cps_envs.core.game.match import Match
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Array, FloatArray, Role

OnStep = Callable[[Game], None]


def play_episodes(
    problem: Problem,
    config: Any,
    players: Mapping[Role, PolicyReference],
    seeds: Sequence[int],
    *,
    on_step: OnStep | None = None,
) -> dict[str, Array]:
    """One episode per seed, all at once: the attacker's `return` and the problem's metrics at the end, each (B,).

    Roles that are missing from `players` take their neutral action. `on_step` sees the game at the start and after
    each decision.
    """
    match = problem.match(config, len(seeds), players)
    match.reset(np.ones(len(seeds), np.bool_), seeded(seeds))
    payoff = finish(match, on_step=on_step)
    return {"return": payoff, **{name: values.copy() for name, values in match.game.metrics().items()}}


def finish(match: Match, *, on_step: OnStep | None = None) -> FloatArray:
    """Play every environment of a match to its end; returns the attacker's payoff (B,) on the way there."""
    game = match.game
    intervals = [game.decision_interval[role] for role in match.players] or list(game.decision_interval.values())
    stride = gcd(*intervals)
    payoff = np.zeros(game.num_envs)
    if on_step is not None:
        on_step(game)
    while (active := (game.elapsed < game.horizon) & ~game.terminated).any():
        left = int((game.horizon - game.elapsed[active]).min())
        payoff += match.step({}, active, min(stride, left))
        if on_step is not None:
            on_step(game)
    return payoff
