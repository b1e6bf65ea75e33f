from __future__ import annotations

import math

import numpy as np
import pytest

from cps_envs.testbed.config import RobotConfig
from cps_envs.testbed.controllers import order_speed, pursue
from cps_envs.testbed.robot import drive
from cps_envs.testbed.state import Rules, rules_of

QUIET = rules_of(RobotConfig(speed_noise_mps=0.0))
RADIUS = 1.5


def followed(x: float, y: float, heading: float, seconds: float) -> np.ndarray:
    """Distances from the circle (m) of a robot that knows where it is and steers 20 times a second."""
    pose, distances = np.array([x, y, heading]), []
    wheels = np.full(2, 0.25 / 0.016)
    for step in range(round(100 * seconds)):
        if step % 5 == 0:
            turning = pursue(np.array([*pose, 0.25]), QUIET)
        drive(pose, wheels, np.ones(2), 0.25, turning, 0.0, QUIET)
        distances.append(math.hypot(pose[0], pose[1]) - RADIUS)
    return np.array(distances)


@pytest.mark.parametrize(
    ("x", "heading"), [(1.5, math.pi / 2), (1.3, math.pi / 2), (1.7, math.pi / 2), (1.5, math.pi / 2 + 0.8), (1.4, 0.3)]
)
def test_pure_pursuit_converges_to_the_circle(x: float, heading: float) -> None:
    distances = followed(x, 0.0, heading, 20.0)
    assert np.abs(distances[-500:]).max() < 0.003
    assert np.abs(distances).max() < abs(x - RADIUS) + 0.15


def test_on_the_circle_the_turning_rate_is_speed_over_radius() -> None:
    """A chord of the circle makes half its arc's angle with the tangent: omega = 2 v sin(a / 2) / (2 R sin(a / 2))."""
    for angle in (0.0, 1.0, -3.0):
        estimate = np.array([RADIUS * math.cos(angle), RADIUS * math.sin(angle), angle + math.pi / 2, 0.25])
        assert pursue(estimate, QUIET) == pytest.approx(0.25 / RADIUS)
    assert pursue(np.array([RADIUS, 0.0, math.pi / 2, -0.1]), QUIET) == 0.0


def test_turns_towards_the_circle() -> None:
    on_tangent = 0.25 / RADIUS
    assert pursue(np.array([1.6, 0.0, math.pi / 2, 0.25]), QUIET) > on_tangent
    assert pursue(np.array([1.4, 0.0, math.pi / 2, 0.25]), QUIET) < on_tangent


def accelerated(acceleration: float, start: float, seconds: float, rules: Rules = QUIET) -> np.ndarray:
    """Speeds (m/s) at each control period of a robot with wheel lag that is told its own speed."""
    pose, wheels, integral, speed, speeds = np.zeros(3), np.full(2, start / 0.016), np.zeros(1), start, []
    for _ in range(round(20 * seconds)):
        order = order_speed(speed, acceleration, integral, 0, rules)
        for _ in range(5):
            speed = drive(pose, wheels, np.ones(2), order, 0.0, 0.0, rules)
        speeds.append(speed)
    return np.array(speeds)


def test_the_speed_loop_acts_as_an_integrator_of_the_acceleration() -> None:
    """With K_p = tau_w / T - 1 a lag in discrete time makes v + 0.82 T u of v + T u, and K_i adds to that slowly."""
    for acceleration in (0.05, 0.1, -0.1):
        speeds = accelerated(acceleration, 0.2, 0.5)
        slope = np.diff(speeds) / 0.05
        np.testing.assert_allclose(slope, 2.0 * (1.0 - 0.9**5) * acceleration, rtol=0.03)
        assert np.sign(acceleration) * (slope[-1] - slope[0]) > 0.0


def test_one_order_by_hand() -> None:
    integral = np.array([0.01, 0.02])
    order = order_speed(0.2, 0.1, integral, 1, QUIET)
    assert integral.tolist() == pytest.approx([0.01, 0.02 + 0.05 * 0.005])
    assert order == pytest.approx(0.205 + 1.0 * 0.005 + 0.1 * 0.02025)


def test_orders_and_integral_are_limited() -> None:
    integral = np.array([0.0])
    assert order_speed(0.35, 0.1, integral, 0, QUIET) == 0.35
    assert order_speed(0.01, -0.5, integral, 0, QUIET) == 0.0
    for _ in range(1000):
        order_speed(0.0, 10.0, integral, 0, QUIET)
    assert integral[0] == 0.05
    assert accelerated(0.1, 0.3, 5.0).max() <= 0.35
    assert accelerated(-0.5, 0.3, 5.0).min() >= 0.0
