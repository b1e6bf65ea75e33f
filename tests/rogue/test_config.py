"""The configuration: presets, bounds, the stable step, and errors that name the remedy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.rogue.config import EASY, PAPER, RogueConfig
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.stability import largest_ahead, largest_behind


def make(**overrides: Any) -> RogueConfig:
    return ROGUE.config("paper", overrides)


def test_paper_is_table_5_1_and_deterministic() -> None:
    assert (PAPER.num_vehicles, PAPER.attacker_index) == (5, 3)
    assert (PAPER.drive_mps2, PAPER.drag_per_s, PAPER.max_effort, PAPER.min_effort) == (5.0, 0.1, 1.0, -1.0)
    assert (PAPER.surface_slope_per_s, PAPER.boundary_layer_mps) == (0.1, 0.025)
    assert (PAPER.alarm_threshold, PAPER.detector_cutoff_hz) == (200.0, 0.01)
    assert PAPER.contact == "pass"
    assert not any(isinstance(value, tuple) for value in vars(PAPER).values())


def test_learning_is_solid_finely_integrated_and_priced() -> None:
    assert EASY.contact == "solid"
    assert EASY.dt_s <= 0.001
    assert EASY.power_ratio == (1.0, 1.6)
    assert EASY.formation_weight_mps2 == 0.5


@pytest.mark.parametrize(
    ("overrides", "bound_s"),
    [({}, 1.11e-3), ({"onset_s": 5.0, "dt_s": 0.0005}, 0.90e-3), ({"num_vehicles": 30, "dt_s": 0.0005}, 0.83e-3)],
)
def test_stable_steps_of_the_specification(overrides: dict[str, float], bound_s: float) -> None:
    assert make(**overrides).stable_below_s == pytest.approx(bound_s, rel=0.01)


def coupling(num_vehicles: int) -> Array:
    """K in e_front + e_rear = -K x + constants: each vehicle between its neighbours, the rear one has one."""
    matrix = 2.0 * np.eye(num_vehicles) - np.eye(num_vehicles, k=1) - np.eye(num_vehicles, k=-1)
    matrix[0, 0] = 1.0
    return matrix


def test_the_largest_couplings_of_the_specification() -> None:
    assert largest_behind(5) == pytest.approx(3.68, abs=0.005)
    assert largest_ahead(2) == pytest.approx(3.0)


@pytest.mark.parametrize("num_vehicles", [3, 5, 12, 100])
def test_the_largest_couplings_are_eigenvalues(num_vehicles: int) -> None:
    whole = coupling(num_vehicles)
    assert largest_behind(num_vehicles) == pytest.approx(np.linalg.eigvalsh(whole)[-1])
    for place in range(1, num_vehicles):
        assert largest_ahead(num_vehicles - place) == pytest.approx(np.linalg.eigvalsh(whole[place:, place:])[-1])


def test_a_hundred_vehicles_and_the_step_they_need() -> None:
    with pytest.raises(ConfigurationError, match=r"100 vehicles .* below 0\.000832 s\. Choose dt_s=0\.0005 or"):
        make(num_vehicles=100)
    with pytest.raises(ConfigurationError, match=r"Choose dt_s=0\.0001 or"):
        make(num_vehicles=100, boundary_layer_mps=0.005)
    assert make(num_vehicles=100, attacker_index=(1, 99), dt_s=0.0005).num_intact == 99
