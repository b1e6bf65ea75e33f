"""Games of disbanding and how the tests move them, and episodes of preset `learning`."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.utils import seeding

from cps_envs.core.game.match import Match
from cps_envs.core.types import Array, FloatArray, Role
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.problem import DISBANDING

FIRST = 500_000  # seed of the first episode
LEARNING_ATTACKERS = DISBANDING.opponent("learning", "attacker")


def go(game: DisbandingGame, attack: int = 0, correction: Array | None = None, num_steps: int = 10) -> Array:
    actions = {"attacker": np.full(game.num_envs, attack)}
    if correction is not None:
        actions["defender"] = correction
    return game.advance(actions, np.ones(game.num_envs, bool), num_steps)


def seen(game: DisbandingGame, role: Role) -> dict[str, Array]:
    return game.fields[role].decode(game.observe(role))


def game_of(count: int, preset: str = "learning", **overrides: Any) -> DisbandingGame:
    """A game that nobody has started."""
    game: DisbandingGame = DISBANDING.game(DISBANDING.config(preset, overrides), count)  # type: ignore[assignment]
    return game


def started_match(game: DisbandingGame, **players: Any) -> Match:
    """A match whose episodes have begun, with players by name or as objects."""
    roles = {
        role: DISBANDING.policy(player, game, role) if isinstance(player, str) else player
        for role, player in players.items()
    }
    match = Match(game, roles)  # type: ignore[arg-type]
    match.reset(np.ones(game.num_envs, np.bool_), [seeding.np_random(FIRST + b)[0] for b in range(game.num_envs)])
    return match


def played(
    attacker: Any = LEARNING_ATTACKERS,
    defender: Any = "none",
    count: int = 24,
    **overrides: Any,
) -> tuple[FloatArray, dict[str, Array]]:
    """What the attacker is paid in whole episodes (B,), and the metrics."""
    game = game_of(count, **overrides)
    match = started_match(game, attacker=attacker, defender=defender)
    return match.step({}, np.ones(count, np.bool_), game.horizon), game.metrics()
