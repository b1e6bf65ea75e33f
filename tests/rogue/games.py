"""Games of the rogue vehicle that have begun, and how the tests move them."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from cps_envs.core.types import Array, Role
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.problem import ROGUE
from tests import episodes

FIXED = {"num_vehicles": 5, "attacker_index": 3, "attack_share": 1.0}  # what preset `learning` draws
DEFENDERS = ("pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7")  # of chapter 5
started = partial(episodes.started, ROGUE)
spec_of = partial(episodes.spec_of, ROGUE)
play = partial(episodes.play, ROGUE)
watched = partial(episodes.watched, ROGUE)


def go(game: RogueGame, attack: Array | float = 1.0, defense: Any = None, num_steps: int = 1) -> Array:
    actions = {"attacker": np.full((game.num_envs, game.config.num_seized), attack)}
    if defense is not None:
        actions["defender"] = np.stack([np.asarray(defense)] * game.num_envs)
    return game.advance(actions, np.ones(game.num_envs, bool), num_steps)


def seen(game: RogueGame, role: Role) -> dict[str, Array]:
    return game.fields[role].decode(game.observe(role))
