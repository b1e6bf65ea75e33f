"""The configuration, buildings of one's own, and generated houses."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.config import EASY, PAPER, HvacConfig
from cps_envs.hvac.houses import house
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import filter_sets, membership, sensor_sets
from tests.hvac.games import go, started

SHORT = {"num_steps": 90, "window_steps": 64, "onset_step": 70}


def make(**overrides: Any) -> HvacConfig:
    return HVAC.config("paper", overrides)


def test_paper_is_exact() -> None:
    assert (PAPER.num_steps, PAPER.step_s, PAPER.window_steps, PAPER.prediction_steps) == (720, 120.0, 200, 80)
    assert (PAPER.model_error, PAPER.unmeasured_heat_w, PAPER.onset_step, PAPER.random_compromise) == (0, 0, 200, False)
    assert PAPER.noise_std_c**2 == pytest.approx(0.2)
    assert PAPER.duration_h == pytest.approx(719 / 30)


def test_learning_draws_what_the_specification_says() -> None:
    assert HVAC.config("learning", {"num_compromised": 1}).compromised_weights == ()  # whose place it takes
    with pytest.raises(ConfigurationError, match="say the same"):
        HVAC.config("learning", {"num_compromised": 1, "compromised_weights": (0.5, 0.5)})
    assert (EASY.onset_step, EASY.num_compromised, EASY.random_compromise) == ((100, 400), (1, 3), True)
    assert (EASY.model_error, EASY.unmeasured_heat_w) == (0.02, 50.0)


def test_thresholds_follow_the_number_of_sensors() -> None:
    assert make().threshold_c2 == 0.418
    assert make(num_sensors=8).threshold_c2 == 0.425


def test_too_many_sets_have_to_be_named() -> None:
    zones = 10
    building = {
        "heat_capacity_j_per_k": tuple(0.4e6 + 1e4 * i for i in range(zones)),
        "wall_resistance_k_per_w": (0.1,) * zones,
        "num_sensors": zones,
    }
    with pytest.raises(ConfigurationError, match="sensor_sets"):
        make(**building)
    assert make(**building, sensor_sets=(1, 2, 0, 3, 4)).num_zones == zones


def test_a_building_of_one_s_own_can_be_made_and_played() -> None:
    env = gymnasium.make(
        "cps_envs:cps_envs/HvacDefense-v0",
        preset="paper",
        heat_capacity_j_per_k=[0.5e6, 0.8e6, 0.6e6],
        wall_resistance_k_per_w=[0.2, 0.1, 0.15],
        link_zones=[1, 2, 2, 3],
        link_resistance_k_per_w=[0.02, 0.03],
        ground_zones=[],
        num_sensors=6,
        num_steps=300,
    )
    assert env.action_space.n == 3**3 - 1 - 2**3 + 2
    env.reset(seed=0)
    for _ in range(299):
        _, reward, terminated, _, info = env.step(19)
        assert math.isfinite(reward)
    assert terminated
    assert info["mean_abs_error_c"] < 3


def config_of(num_zones: int, **arguments: Any) -> HvacConfig:
    config: HvacConfig = HVAC.config("paper", house(num_zones, **arguments))
    return config


@pytest.mark.parametrize("num_zones", [2, 3, 4, 7, 16, 30, 64])
def test_every_room_is_linked_to_its_neighbours(num_zones: int) -> None:
    config = config_of(num_zones)
    pairs = set(zip(config.link_zones[::2], config.link_zones[1::2], strict=True))
    reached, waiting = {1}, [1]
    while waiting:
        zone = waiting.pop()
        for one, two in pairs:
            other = two if one == zone else one if two == zone else None
            if other is not None and other not in reached:
                reached.add(other)
                waiting.append(other)
    assert len(reached) == num_zones
    assert max(sum(zone in pair for pair in pairs) for zone in reached) <= 4
    assert max(config.ground_zones) == num_zones


def test_rooms_stand_on_rooms() -> None:
    seven = config_of(7, columns=3)
    assert seven.ground_zones == (5, 6, 7)
    assert seven.link_zones == (2, 3, 3, 4, 5, 6, 6, 7, 1, 2, 2, 5, 3, 6, 4, 7)


def test_a_seed_is_a_building() -> None:
    assert house(9) == house(9)
    assert house(9)["heat_capacity_j_per_k"] != house(9, seed=1)["heat_capacity_j_per_k"]


@pytest.mark.parametrize("num_zones", [4, 16, 64])
@pytest.mark.parametrize("sensors_per_zone", [1, 2])
def test_there_are_as_many_sets_as_sensors(num_zones: int, sensors_per_zone: int) -> None:
    config = config_of(num_zones, sensors_per_zone=sensors_per_zone)
    member = membership(config)
    assert member.shape == (config.num_sensors, config.num_sensors)
    assert (member.sum(axis=1) == config.set_size).all()
    assert (member.sum(axis=0) == config.set_size).all()


def test_sets_of_sensors_in_a_row_go_round() -> None:
    config = HVAC.config("paper", {"set_size": 3})
    assert sensor_sets(config) == ((1, 2, 3), (2, 3, 4), (1, 3, 4), (1, 2, 4))


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"num_zones": 0}, "num_zones = 0"),
        ({"num_zones": 65}, "1 to 64"),
        ({"num_zones": 4, "columns": 0}, "columns = 0"),
        ({"num_zones": 4, "sensors_per_zone": 3}, "sensors_per_zone = 3"),
    ],
)
def test_impossible_houses_are_refused(arguments: dict[str, int], named: str) -> None:
    with pytest.raises(ConfigurationError, match=named):
        house(**arguments)


@pytest.mark.parametrize("num_zones", [16, pytest.param(64, marks=pytest.mark.slow)])
def test_many_zones_are_kept_warm_and_known_by_any_set(num_zones: int) -> None:
    game = started([0, 1], **house(num_zones), onset_step=600)
    go(game, num_steps=210)
    for choice in (1, num_zones, num_zones + 1):
        go(game, choice, num_steps=50)
    assert np.abs(game.state.temperature - 25).max() < 3  # heating cannot cool
    assert np.abs(game.state.estimate[:, 1:-1] - game.state.temperature[:, np.newaxis]).max() < 1.5
    assert game.mean_residuals() == pytest.approx(np.full((2, num_zones), 0.2), abs=0.03)  # the noise's variance


def test_a_house_is_made_by_its_id() -> None:
    env = gymnasium.make("cps_envs:cps_envs/HvacDefense-v0", **{"preset": "paper", **house(9), **SHORT})
    assert env.action_space.n == 9 + 2  # type: ignore[attr-defined]
    observation, _ = env.reset(seed=0)
    assert observation.shape == env.observation_space.shape


def test_sets_have_at_most_one_sensor_of_a_zone_and_not_of_all() -> None:
    config = HVAC.config("paper", {"num_sensors": 8})
    found = sensor_sets(config)
    assert len(found) == 3**4 - 1 - 2**4  # none or one of two for each zone; not none, not one for each
    assert {(1,), (8,), (1, 6, 7)} < set(found)
    assert not {(1, 5), (1, 2, 3, 4)} & set(found)
    assert membership(config, ((1, 5), (8,))).astype(int).tolist() == [[1, 0, 0, 0, 1, 0, 0, 0], [0] * 7 + [1]]
    assert filter_sets(config) == ()
    learning = HVAC.config("learning", {})
    assert filter_sets(learning) == (*sensor_sets(learning), (1, 2, 3, 4), ())
