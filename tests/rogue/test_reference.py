"""The kernels against the plain loop over vehicles, through the game."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.compute.kernels import unpack, view
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import Drawn
from tests.rogue.reference import Reference
from tests.turns import in_turn


def started(config: RogueConfig, seed: int) -> tuple[RogueGame, Reference]:
    game = RogueGame(config, 1)
    game.reset(np.ones(1, bool), [np.random.default_rng(seed)])
    vehicles, c = view(game.state, 0), unpack(Drawn, game.drawn, 0)
    drawn = {name: getattr(c, name) for name in ("drive_mps2", "drag_per_s", "reference_speed_mps")}
    seats = {} if config.attacker_indices else {"attacker_index": c.attacker + 1}
    exact = replace(config, **drawn, **seats)
    return game, Reference(
        exact,
        vehicles.position.copy(),
        vehicles.speed.copy(),
        laws={},
        modified={},
        command={},
        ratio=c.attacker_drive_mps2 / c.drive_mps2,
        onset_s=c.onset_step * config.dt_s,
    )


def effort_of(action: float, reference: Reference, m: int = 3) -> float:
    """Section 8 with the effort that keeps the speed in the middle, of the seized vehicle m."""
    c = reference.c
    cruise = min(c.drag_per_s * reference.v[m] / (reference.ratio * c.drive_mps2), c.max_effort)
    return cruise + action * (c.max_effort - cruise if action > 0 else cruise - c.min_effort)


def play(config: RogueConfig, seed: int, periods: int = 20) -> tuple[RogueGame, Reference]:
    """Random laws or commands and random efforts, in the game and in the reference."""
    game, reference = started(config, seed)
    generator = np.random.default_rng(seed)
    intact = [i for i in range(1, config.num_vehicles + 1) if i not in reference.seats]
    for _ in range(periods):
        attack = [generator.choice([-1.0, 1.0, generator.uniform(-1, 1)]) for _ in reference.seats]
        laws, modified = generator.integers(0, [[len(CONTROLLERS)], [2]], (2, len(intact)))
        commands = generator.uniform(-1, 1, len(intact))
        mode = config.defense_action == "mode"
        defense = np.stack([laws, modified], axis=1).ravel() if mode else commands
        reference.laws = {i: CONTROLLERS[law] if mode else "command" for i, law in zip(intact, laws, strict=True)}
        reference.modified = dict(zip(intact, modified.tolist(), strict=True))
        reference.command = {i: u * (7.5 if u < 0 else 2.5) for i, u in zip(intact, commands, strict=True)}
        efforts = [effort_of(action, reference, m) for action, m in zip(attack, reference.seats, strict=True)]
        game.advance({"attacker": np.array([attack]), "defender": defense[np.newaxis]}, np.ones(1, bool), 1)
        for _ in range(config.steps_per_period):
            reference.step(*efforts)
    return game, reference


def assert_equal(game: RogueGame, reference: Reference) -> None:
    vehicles = view(game.state, 0)
    np.testing.assert_allclose(vehicles.position, reference.x[1:], rtol=0, atol=1e-6)
    np.testing.assert_allclose(vehicles.speed, reference.v[1:], rtol=0, atol=1e-6)
    np.testing.assert_allclose(game.state.damage[0], reference.damage[1:], rtol=0, atol=1e-6)
    z = np.stack([vehicles.front_detector, vehicles.rear_detector], axis=1)
    np.testing.assert_allclose(z, reference.z[1:], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(vehicles.growth, reference.s[1:] - reference.c.separation_m, atol=1e-12)
    sides = {"front": 1, "rear": -1, "": 0}
    assert vehicles.alarm.tolist() == [sides[mode] for mode in reference.mode[1:]]


STARTS: dict[str, dict[str, Any]] = {
    "paper": {},
    "solid": {"contact": "solid", "power_ratio": 1.4},
    "solid, close": {"contact": "solid", "separation_m": 4.8, "spacing_spread_m": 0.1, "speed_spread_mps": 2.0},
    "pass, close": {"contact": "pass", "separation_m": 4.8, "spacing_spread_m": 0.1, "speed_spread_mps": 2.0},
    "quick alarms": {"alarm_threshold": 5.0, "separation_m": 6.0, "growth_interval_s": 0.05},
    "rear attacker": {"attacker_index": 1, "power_ratio": 1.2, "dt_s": 0.0005},
    "the leader seized": {"attacker_index": 5, "power_ratio": 1.2, "dt_s": 0.0005, "contact": "solid"},
    "two seized": {"attacker_indices": (2, 4), "power_ratio": 1.2, "contact": "solid"},
    "neighbors and the leader": {"attacker_indices": (2, 3, 6), "num_vehicles": 6, "dt_s": 0.0005, "onset_s": 1.0},
    "long platoon": {"num_vehicles": 9, "attacker_index": 6, "dt_s": 0.0005, "contact": "solid"},
    "drawn": {
        "drive_mps2": (4.5, 5.5),
        "drag_per_s": (0.09, 0.11),
        "reference_speed_mps": (20, 30),
        "onset_s": (0, 2),
        "attacker_index": (2, 4),
        "dt_s": 0.0005,
        "speed_spread_mps": 1,
    },
    "commands": {"defense_action": "command", "contact": "solid"},
    "returning": {"human_returns": True, "growth_interval_s": 0.3},
}


@cache
def played(case: str, seed: int) -> tuple[RogueGame, Reference]:
    return play(ROGUE.config("paper", STARTS[case]), seed)


@pytest.mark.parametrize("case", STARTS)
@pytest.mark.parametrize("seed", in_turn([0, 1], 2))
def test_kernels_agree_with_the_plain_loop(case: str, seed: int) -> None:
    assert_equal(*played(case, seed))


def test_the_cases_reach_alarms_growth_and_contact() -> None:
    seen = {"alarm": False, "growth": False, "pass": False, "solid": False}
    for case in STARTS:
        game, _ = played(case, 0)
        seen["alarm"] |= bool(game.state.alarm.any())
        seen["growth"] |= bool(game.state.growth.any())
        seen[game.config.contact] |= bool(game.state.damage.any())
    assert all(seen.values()), seen


def test_standing_vehicles() -> None:
    game, reference = started(ROGUE.config("paper", {"reference_speed_mps": 3.0}), 0)
    reference.laws, reference.modified = dict.fromkeys((1, 2, 4, 5), "linear"), dict.fromkeys((1, 2, 4, 5), False)
    brake = {"attacker": np.array([[-1.0]]), "defender": np.zeros((1, 8), np.int64)}
    for _ in range(10):
        effort = effort_of(-1.0, reference)
        game.advance(brake, np.ones(1, bool), 1)
        for _ in range(100):
            reference.step(effort)
    assert reference.v[3] == 0.0
    assert_equal(game, reference)


@given(seed=st.integers(0, 2**20), contact=st.sampled_from(["pass", "solid"]))
@settings(max_examples=5, deadline=None)
def test_any_seed(seed: int, contact: str) -> None:
    config = ROGUE.config("paper", {"contact": contact, "separation_m": 6.5, "alarm_threshold": 20.0})
    assert_equal(*play(config, seed, periods=10))
