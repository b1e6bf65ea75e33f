"""Games of the HVAC problem that have begun, and how the tests move them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from cps_envs.core.types import Array, Role
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from tests import episodes

SHORT = {"num_steps": 90, "window_steps": 40, "onset_step": 45}
QUIET = {"noise_std_c": 0.0}
started = partial(episodes.started, HVAC)
spec_of = partial(episodes.spec_of, HVAC, preset="learning")
watched = partial(episodes.watched, HVAC, preset="learning")


def go(game: HvacGame, choice: int = 0, attack: Array | list[float] | None = None, num_steps: int = 1) -> Array:
    actions = {"defender": np.full(game.num_envs, choice)}
    if attack is not None:
        actions["attacker"] = np.broadcast_to(attack, (game.num_envs, game.action_space["attacker"].shape[0])).copy()
    return game.advance(actions, np.ones(game.num_envs, bool), num_steps)


def seen(game: HvacGame, role: Role) -> dict[str, Array]:
    return game.fields[role].decode(game.observe(role))


def play(attacker: Any, defender: Any, seeds: Sequence[int] = range(10), preset: str = "paper", **rest: Any) -> Any:
    return episodes.play(HVAC, attacker, defender, seeds, preset, **rest)
