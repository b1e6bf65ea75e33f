"""Episodes that move side by side move as each does alone, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.types import Array, Role
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.lanes import WIDTH, WORTH, lane, load, make_block, make_plants, store
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import platoon
from tests.episodes import started

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


def test_an_episode_goes_into_a_lane_and_comes_back() -> None:
    """Its lane shows the vehicles of its platoon as the state does; store brings back what has changed in it."""
    game, n, generator = started(ROGUE, (0, 1), "learning"), 4, np.random.default_rng(0)
    for values in game.state:
        values[...] = generator.integers(0, 2, values.shape) if values.dtype == bool else generator.random(values.shape)
        values[1] = ~values[0] if values.dtype == bool else values[0] + 1
    block, plants, start = make_block(n, WIDTH), make_plants(1, WIDTH), [values.copy() for values in game.state]
    drawn = game.drawn.view(np.recarray)
    for b, k in ((1, 7), (0, 7), (1, 8)):  # the second takes the place of the first
        load(block, plants, game.state, drawn, b, k, n)
    for b, k in ((0, 7), (1, 8)):
        shown = lane(block, game.state, b, k, n)
        for name, values in platoon(game.state, b, n)._asdict().items():
            np.testing.assert_array_equal(getattr(shown, name), values, err_msg=name)
        bodies = [name for name in plants._fields if getattr(plants, name).ndim == 2]
        strong, usual = drawn[b]["attacker_drive_mps2"], drawn[b]["drive_mps2"]
        own = {"attacker_drive_mps2": strong * (game.state.drive_mps2[b, 0] / usual)}
        own |= {name: getattr(game.state, name)[b, 0] for name in bodies if name not in own}
        assert {name: getattr(plants, name)[0, k] for name in bodies} == own
        others = set(plants._fields) - {*bodies, "reference_mps2"}  # which the step looks up
        assert all(getattr(plants, name)[k] == drawn[b][name] for name in others)
    moved = lane(block, game.state, 0, 7, n)
    still = {"growth", "rogue", "alarm", "controller", "damage", "collisions", "place", *bodies}  # which are not moved
    for name in set(moved._fields) - still:
        values = getattr(moved, name)
        values[:] = ~values if values.dtype == bool else values + 5
        kept = platoon(game.state, 0, n)
        assert not (getattr(kept, name) == values).any(), name
    for b, k in ((0, 7), (1, 8)):
        store(block, game.state, b, k, n)
    for name, before, values in zip(moved._fields, start, game.state, strict=True):
        np.testing.assert_array_equal(values[1], before[1], err_msg=name)
        changed = getattr(moved, name)
        np.testing.assert_array_equal(values[0].reshape(-1)[: changed.size], changed, err_msg=name)
        np.testing.assert_array_equal(values[0].reshape(-1)[changed.size :], before[0].reshape(-1)[changed.size :])
