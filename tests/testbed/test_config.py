from __future__ import annotations

from dataclasses import replace

import pytest

from cps_envs.testbed.config import BASELINE, MITIGATED, RobotConfig
from cps_envs.testbed.problem import TESTBED, attack_fields, defense_fields
from cps_envs.testbed.state import rules_of


def test_the_road_is_ten_times_as_large_and_has_the_limits_of_table_2_1() -> None:
    road = BASELINE.road
    assert (road.min_acceleration_mps2, road.max_acceleration_mps2) == (-5.0, 1.0)
    assert (road.desired_speed_mps, road.max_speed_mps) == pytest.approx((2.5, 3.5))
    assert (road.desired_gap_m, road.standstill_gap_m) == pytest.approx((3.5, 2.4))
    assert (road.headway_s, road.driver_headway_s, road.control_period_s, road.duration_s) == (1.0, 1.3, 0.05, 60.0)
    assert (road.proportional_gain, road.derivative_gain, road.num_platoons) == (1.0, 3.0, 3)


def test_numbers_of_the_loop() -> None:
    assert (BASELINE.num_robots, BASELINE.steps_per_period, BASELINE.delay_periods, BASELINE.num_periods) == (
        9,
        5,
        1,
        1200,
    )
    assert BASELINE.window == (400, 1000)
    assert BASELINE.string_length_m == pytest.approx(6 * 0.35 + 2 * 0.25 + 0.10)
    assert replace(BASELINE, avoidance="until_disbanding") == MITIGATED
    assert BASELINE.speed_gain == pytest.approx(BASELINE.wheel_lag_s / BASELINE.control_period_s - 1.0)
    assert rules_of(RobotConfig(camera_noise_m=0.0)).camera_variance_m2 == pytest.approx(1e-8)
    assert rules_of(BASELINE).camera_variance_m2 == pytest.approx(0.25e-6)


def test_observations_are_those_of_the_road() -> None:
    game = TESTBED.game(BASELINE, 1)
    assert game.fields["attacker"].size == attack_fields(BASELINE).size
    assert game.fields["defender"].size == defense_fields(BASELINE).size
