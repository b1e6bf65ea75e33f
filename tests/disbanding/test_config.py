"""The configuration: presets, bounds, and errors that name the remedy."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.config import is_multiple
from cps_envs.core.errors import ConfigurationError
from cps_envs.disbanding.config import EASY, PAPER, DisbandingConfig
from cps_envs.disbanding.problem import DISBANDING


def make(**overrides: Any) -> DisbandingConfig:
    return DISBANDING.config("paper", overrides)


def test_paper_is_table_2_1_and_deterministic() -> None:
    assert (PAPER.num_platoons, PAPER.vehicles_per_platoon, PAPER.duration_s) == (10, 10, 180.0)
    assert (PAPER.proportional_gain, PAPER.derivative_gain, PAPER.headway_s) == (1.0, 5.0, 1.5)
    assert PAPER.gap_spread == PAPER.speed_spread_mps == PAPER.takeover_delay_s == PAPER.collision_penalty == 0.0
    assert PAPER.horizon_steps == 18_000
    assert PAPER.steps_per_period == 10
    assert PAPER.periods_per_second == 10


def test_learning_draws_what_the_specification_says() -> None:
    assert EASY.tau_s == (0.1, 0.5)
    assert EASY.desired_gap_m == (4.0, 6.0)
    assert EASY.collision_penalty == 0.3
    assert EASY.max_budget == 3


@pytest.mark.parametrize(
    ("overrides", "remedy"),
    [
        ({"tau": 0.3}, "'tau_s'"),
        ({"control_period_s": 0.3}, "control_period_s=0.1"),
        ({"control_period_s": 0.025}, "integration step"),
        ({"interpretation": "S2", "control_period_s": 0.01}, "integration step 0.05"),
        ({"interpretation": "S1", "tau_s": 0.01}, 'interpretation="S2"'),
        ({"duration_s": 10.5}, "duration"),
        ({"attack_budget": 11}, "num_platoons"),
        ({"desired_speed_mps": 40.0}, "max_speed_mps"),
        ({"dt_s": 0.0001}, "Choose 0"),
        ({"dt_s": 0.03}, "integration step 0.03"),
        ({"dt_s": 0.05, "tau_s": 0.02, "control_period_s": 0.1}, "a shorter dt_s"),
        ({"standstill_rule": True, "desired_gap_m": 1.0}, "larger desired_gap_m"),
        ({"standstill_rule": True, "desired_gap_m": 1.5, "gap_spread": 0.4}, "smaller gap_spread"),
    ],
)
def test_combinations_that_cannot_be_right(overrides: dict[str, Any], remedy: str) -> None:
    with pytest.raises(ConfigurationError, match=remedy):
        make(**overrides)


@given(part=st.sampled_from([0.01, 0.02, 0.05, 0.1, 0.25, 1.0]), count=st.integers(1, 2000))
def test_multiples(part: float, count: int) -> None:
    assert is_multiple(part * count, part)
    assert not is_multiple(part * (count + 0.5), part)
