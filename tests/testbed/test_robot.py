from __future__ import annotations

import math

import numpy as np
import pytest

from cps_envs.testbed.config import RobotConfig
from cps_envs.testbed.robot import advanced_arc, drive, wheel_target, wrapped
from cps_envs.testbed.state import rules_of

QUIET = rules_of(RobotConfig(speed_noise_mps=0.0))
IDEAL = np.ones(2)


def steady_wheels(speed: float, turning: float) -> np.ndarray:
    return np.array([speed - turning * 0.083 / 2, speed + turning * 0.083 / 2]) / 0.016


def test_a_robot_at_rest_picks_up_speed_with_the_lag_of_its_wheels_on_a_straight_line() -> None:
    pose, wheels = np.array([1.0, 2.0, 0.6]), np.zeros(2)
    speeds = [drive(pose, wheels, IDEAL, 0.25, 0.0, 0.0, QUIET) for _ in range(40)]
    expected = 0.25 * (1.0 - 0.9 ** np.arange(1, 41))  # dt / tau_w = 0.1
    np.testing.assert_allclose(speeds, expected, rtol=1e-12)
    travelled = 0.01 * expected.sum()
    np.testing.assert_allclose(
        pose, [1.0 + travelled * math.cos(0.6), 2.0 + travelled * math.sin(0.6), 0.6], rtol=1e-12
    )


def test_constant_wheels_drive_a_regular_polygon_around_a_circle() -> None:
    speed, turning = 0.25, 0.5
    pose, wheels, places = np.array([0.0, 0.0, 0.0]), steady_wheels(speed, turning), []
    for _ in range(1257):  # once around
        drive(pose, wheels, IDEAL, speed, turning, 0.0, QUIET)
        places.append(pose[:2].copy())
    side, angle = speed * 0.01, turning * 0.01
    circumradius = side / (2 * math.sin(angle / 2))
    center = circumradius * np.array([math.sin(angle / 2), math.cos(angle / 2)])
    np.testing.assert_allclose(np.hypot(*(np.array(places) - center).T), circumradius, rtol=1e-9)
    assert circumradius == pytest.approx(speed / turning, rel=1e-4)
    assert pose[2] == pytest.approx(1257 * angle)


def test_wheels_have_a_top_speed_and_errors_of_their_own() -> None:
    assert wheel_target(2.0, 0.0, 1.0, QUIET) == 60.0
    assert wheel_target(-2.0, 0.0, 1.0, QUIET) == -60.0
    pose, wheels = np.zeros(3), np.zeros(2)
    for _ in range(500):
        speed = drive(pose, wheels, np.array([0.98, 1.03]), 0.25, 0.0, 0.0, QUIET)
    assert speed == pytest.approx(0.25 * (0.98 + 1.03) / 2)
    np.testing.assert_allclose(wheels, 0.25 / 0.016 * np.array([0.98, 1.03]))


def test_noise_is_on_the_speed_of_moving_robots_only() -> None:
    noisy = rules_of(RobotConfig())
    moved = drive(np.zeros(3), steady_wheels(0.25, 0.0), IDEAL, 0.25, 0.0, 3.0, noisy)
    assert moved - 0.25 == pytest.approx(3.0 * 0.0002)
    assert drive(np.zeros(3), np.zeros(2), IDEAL, 0.0, 0.0, 3.0, noisy) == 0.0


def test_arc_positions_go_on_over_the_seam() -> None:
    radius, arc = 1.5, 0.0
    for angle in np.linspace(0.0, 20.0, 500)[1:]:
        arc = advanced_arc(arc, 1.4 * math.cos(angle), 1.4 * math.sin(angle), radius)
        assert arc == pytest.approx(radius * angle)
    assert wrapped(math.pi + 0.1) == pytest.approx(-math.pi + 0.1)
