"""The configuration: presets, bounds, and errors that name the remedy."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.config import is_multiple
from cps_envs.disbanding.config import EASY, PAPER


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


@given(part=st.sampled_from([0.01, 0.02, 0.05, 0.1, 0.25, 1.0]), count=st.integers(1, 2000))
def test_multiples(part: float, count: int) -> None:
    assert is_multiple(part * count, part)
    assert not is_multiple(part * (count + 0.5), part)
