"""Platoons of vehicles that differ: trucks among cars."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.rogue.config import OF_VEHICLES, RogueConfig
from cps_envs.rogue.problem import ROGUE
from tests.rogue.games import go, started

ALIKE = {"drive_mps2": 5.0, "drag_per_s": 0.1, "vehicle_length_m": 4.5, "proportional_gain": 1.0}
TRUCK = {"drive_mps2": (5, 3, 5, 5, 5), "vehicle_length_m": (4.5, 16.5, 4.5, 4.5, 4.5), "separation_m": 20.0}


def drawn(**changes: Any) -> dict[str, np.ndarray]:
    game = started(range(32), "learning", **{"num_vehicles": 5, "attacker_index": 3, **changes})
    vehicles = {name: getattr(game.state, name.replace("vehicle_", "")) for name in OF_VEHICLES}
    return {**vehicles, "position": game.state.position, "seized": game.drawn["drive_mps2"]}


@pytest.mark.parametrize("preset", ["paper", "learning"])
def test_vehicles_named_one_by_one_that_are_alike_move_as_ever(preset: str) -> None:
    size = {"num_vehicles": 5, "attacker_index": 3}
    one = started((0, 1), preset, **size, **ALIKE)
    each = started((0, 1), preset, **size, **{name: [value] * 5 for name, value in ALIKE.items()})
    orders = [4 if preset == "paper" else 0, 0] * (4 if preset == "paper" else 5)  # by hand, and by the linear law
    for game in (one, each):
        go(game, 1.0, orders, num_steps=200)
    for name in ("position", "speed", "acceleration", "front_detector", "damage"):
        np.testing.assert_array_equal(getattr(one.state, name), getattr(each.state, name))


def test_each_vehicle_has_its_own_engine() -> None:
    orders = {"defense_action": "command"}
    game = started((0,), "paper", **TRUCK, **orders, drag_per_s=(0.1, 0.05, 0.1, 0.1, 0.1))
    go(game, 0.0, np.full(4, 1.0))
    state, r = game.state, game.config
    speed = state.speed[0] - state.acceleration[0] * r.dt_s
    assert state.acceleration[0, [0, 1, 3]] == pytest.approx(
        np.array([5, 3, 5]) - np.array([0.1, 0.05, 0.1]) * speed[[0, 1, 3]], rel=1e-9
    )
    assert state.acceleration[0, 2] == pytest.approx(0.0, abs=1e-9)  # the attacker keeps its speed


def test_a_seized_truck_is_as_strong_as_a_truck() -> None:
    assert set(drawn(drive_mps2=(5, 5, 4, 5, 5))["seized"].tolist()) == {4.0}
    game = started((0,), "paper", drive_mps2=(5, 5, 3, 5, 5), power_ratio=2.0)
    assert game.truth(0)["power_ratio"] == 2.0
    go(game, 1.0)
    assert game.state.acceleration[0, 2] == pytest.approx(6.0 - 0.1 * game.state.speed[0, 2], abs=1e-2)


def test_gains_and_lengths_are_of_each_vehicle() -> None:
    game = started((0,), "paper", proportional_gain=(1, 2, 1, 1, 1), derivative_gain=(3, 0, 3, 3, 3))
    game.state.position[0, 1] -= 0.25  # its front gap is wider by 0.25 m, and its rear one closer: 0.5 m in all
    game.rules["steps_per_period"] = 1
    go(game, 0.0, [0, 0] * 4)
    assert game.state.acceleration[0] == pytest.approx([-0.25, 1.0, 0, 0, 0])
    assert game.state.proportional_gain.tolist() == [[1, 2, 1, 1, 1]]
    solid = started((0,), "paper", **TRUCK, contact="solid")
    solid.state.position[0, 1] += 9.6  # 20 - 10.5 m are between the bumpers
    go(solid, 0.0)
    assert solid.state.collisions[0].tolist() == [0, 1, 0, 0]


def test_pairs_are_drawn_for_all_or_for_each() -> None:
    plain = drawn(vehicle_length_m=4.5)
    for name, low, high in (("drive_mps2", 4.0, 5.0), ("vehicle_length_m", 4.0, 6.0), ("derivative_gain", 2.0, 3.0)):
        shared = drawn(**{name: (low, high)})
        each = drawn(**{name: ((low, high), 5, (low, high), (5, 5), (low, high))})
        assert shared[name].shape == (32, 1)
        assert each[name].shape == (32, 5)
        for values in (shared[name], each[name][:, ::2]):
            assert (low <= values.min()) & (values.max() < high) & (np.ptp(values, axis=0) > 0.5 * (high - low)).all()
        assert (each[name][:, [1, 3]] == 5).all()
        assert (np.ptp(each[name][:, ::2], axis=1) > 0).all()
        for found in (shared, each):  # nothing else is drawn otherwise
            np.testing.assert_array_equal(found["position"], plain["position"])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"drive_mps2": (5, 5, 5)}, "drive_mps2 has 3 values for 5 vehicles.*two are written as"),
        ({"drive_mps2": ((4, 5), (5, 5))}, "drive_mps2 has 2 values for 5 vehicles"),
        ({"drive_mps2": ()}, "must be a number or a pair .* or a tuple with one for each vehicle in m/s2"),
        ({"drive_mps2": (5, 5, "5", 5, 5)}, "must be a number or a pair"),
        ({"drive_mps2": (5, 5, (1, 2, 3), 5, 5)}, "must be a number or a pair"),
        ({"drive_mps2": (5, 5, (5, 4), 5, 5)}, "lower end comes first"),
        ({"drive_mps2": (5, 5, 50, 5, 5)}, "drive_mps2 = 50 is outside"),
        ({"drive_mps2": (5, 2, 5, 5, 5)}, "reference_speed_mps = 25.0 is out of reach: drive and drag allow 20 m/s"),
        ({"vehicle_length_m": (4.5, 16.5, 4.5, 4.5, 4.5)}, "between centres, and above 10.5 m"),
    ],
)
def test_impossible_platoons_are_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        ROGUE.config("paper", change)


def test_a_drawn_number_of_vehicles_names_the_longest_platoon() -> None:
    config = ROGUE.config("learning", {"drive_mps2": [5.0] * 8})
    assert (config.num_bodies, RogueConfig().num_bodies) == (8, 1)
