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
