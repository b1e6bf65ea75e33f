"""The configuration: presets, bounds, and errors that name the remedy."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.config import EASY, PAPER, HvacConfig
from cps_envs.hvac.problem import HVAC


def make(**overrides: Any) -> HvacConfig:
    return HVAC.config("paper", overrides)


def test_paper_is_exact() -> None:
    assert (PAPER.num_steps, PAPER.step_s, PAPER.window_steps, PAPER.prediction_steps) == (720, 120.0, 200, 80)
    assert (PAPER.model_error, PAPER.unmeasured_heat_w, PAPER.onset_step, PAPER.random_compromise) == (0, 0, 200, False)
    assert PAPER.noise_std_c**2 == pytest.approx(0.2)
    assert PAPER.duration_h == pytest.approx(719 / 30)


def test_learning_draws_what_the_specification_says() -> None:
    assert (EASY.onset_step, EASY.num_compromised, EASY.random_compromise) == ((100, 400), (1, 3), True)
    assert (EASY.model_error, EASY.unmeasured_heat_w) == (0.02, 50.0)


def test_thresholds_follow_the_number_of_sensors() -> None:
    assert make().threshold_c2 == 0.418
    assert make(num_sensors=8).threshold_c2 == 0.425


@pytest.mark.parametrize(
    ("overrides", "remedy"),
    [
        ({"heat_capacity_j_per_k": (0.52e6, -1.0, 0.35e6, 0.55e6)}, "outside"),
        ({"heat_capacity_j_per_k": (0.0, 1e6, 1e6, 1e6)}, "outside"),
        ({"wall_resistance_k_per_w": (0.42, 0.0, 0.12, 0.15)}, "outside"),
        ({"link_resistance_k_per_w": (0.016, 0.012, -0.017, 0.047)}, "outside"),
        ({"wall_resistance_k_per_w": (0.42, 0.1, 0.12)}, "one per zone"),
        ({"heat_capacity_j_per_k": (1e6,), "wall_resistance_k_per_w": (0.1,)}, "2 to 64"),
        ({"link_zones": (1, 2, 3)}, "pairs of zones"),
        ({"link_zones": (1, 2, 1, 3, 2, 4, 2, 1)}, "given once"),
        ({"link_zones": (1, 1, 1, 3, 2, 4, 3, 4)}, "two different zones"),
        ({"link_zones": (1, 2, 1, 3, 2, 4, 3, 5)}, "from 1 to 4"),
        ({"link_resistance_k_per_w": (0.016,)}, "one per link"),
        ({"ground_zones": (5,)}, "from 1 to 4"),
        ({"step_s": 3600.0}, "shorter step_s"),
        ({"num_sensors": 6}, "choose 4 or 8"),
        ({"sensor_low_c": 40.0}, "below sensor_high_c"),
        ({"reference_c": 45.0}, "widen sensor_low_c"),
        ({"initial_c": 5.0}, "widen sensor_low_c"),
        ({"thresholds_c2": (0.4,)}, "for two"),
        ({"thresholds_c2": (0.0, 0.4)}, "outside"),
        ({"sensor_sets": (1, 5, 0, 2)}, "from 1 to 4"),
        ({"sensor_sets": (1, 1, 0, 2)}, "each once"),
        ({"sensor_sets": (1, 0, 0, 2)}, "single 0"),
        ({"sensor_sets": (1, 2, 0, 2, 1)}, "twice"),
        ({"sensor_sets": (1, 2)}, "2 to 256"),
        ({"attack_order": (1, 5)}, "1 to 4"),
        ({"attack_order": (1, 1)}, "once"),
        ({"attack_order": (1,), "num_compromised": 2}, "name more"),
        ({"num_compromised": 5}, "lower it"),
        ({"onset_step": 720}, "raise num_steps"),
        ({"onset_step": (100, 800)}, "raise num_steps"),
        ({"window_steps": 3}, "window_steps"),
        ({"window_steps": 720}, "num_steps"),
        ({"window": 100}, "'window_steps'"),
    ],
)
def test_combinations_that_cannot_be_right(overrides: dict[str, Any], remedy: str) -> None:
    with pytest.raises(ConfigurationError, match=remedy):
        make(**overrides)


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
        _, reward, _, truncated, info = env.step(19)
        assert math.isfinite(reward)
    assert truncated
    assert info["mean_abs_error_c"] < 3
