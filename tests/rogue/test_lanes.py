"""Episodes that move side by side move as each does alone, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.types import Array, Role
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.lanes import WIDTH, WORTH
from cps_envs.rogue.problem import ROGUE

PRESETS = ("paper", "learning", "easy", "seats")
CONTACTS = {"pass": {"contact": "pass"}, "solid": {"contact": "solid", "bumper_mps": 1.0}}
PERIODS = 24


def moved(game: RogueGame, actions: list[dict[Role, Array]], seeds: range) -> Array:
    """The bytes of each environment after the actions; every third one pauses at every other step."""
    every = np.ones(game.num_envs, bool)
    game.reset(every, [np.random.default_rng(seed) for seed in seeds])
    for k, action in enumerate(actions):
        awake = every if k % 2 else np.array([seed % 3 > 0 for seed in seeds])
        game.advance({role: values[seeds.start : seeds.stop] for role, values in action.items()}, awake, 2)
    return np.array([b"".join(part[b].tobytes() for part in game.parts()) for b in range(game.num_envs)])


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("preset", PRESETS)
def test_side_by_side_as_alone(preset: str, contact: str) -> None:
    overrides: dict[str, Any] = {**CONTACTS[contact], "onset_s": 0.3, "spacing_spread_m": 2.0, "speed_spread_mps": 2.0}
    config = ROGUE.config(preset, overrides | ({"dt_s": 0.0005} if preset == "paper" else {}))
    many = 2 * WIDTH + WORTH  # two blocks, and one that is not full
    together = ROGUE.game(config, many)
    rng = np.random.default_rng(5)
    spaces = {role: together.action_space[role] for role in ("attacker", "defender")}
    for k, space in enumerate(spaces.values()):
        space.seed(k)
    actions: list[dict[Role, Array]] = [
        {
            "attacker": rng.uniform(-1.0, 1.0, (many, 1)),
            "defender": np.stack([spaces["defender"].sample() for _ in range(many)]),
        }
        for _ in range(PERIODS)
    ]
    side_by_side = moved(together, actions, range(many))
    alone = [moved(ROGUE.game(config, 1), actions, range(b, b + 1))[0] for b in range(many)]
    assert list(side_by_side) == alone
    assert together.metrics()["collisions"].sum() > 0
    assert together.metrics()["alarms"].sum() > 0
