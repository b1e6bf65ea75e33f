"""The parts of a robot: wheels, steering, speed loop, filter."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cps_envs.core.types import Array
from cps_paper.testbed.robots.config import BASELINE, RobotConfig
from cps_paper.testbed.robots.controllers import order_speed, pursue
from cps_paper.testbed.robots.kalman import INITIAL_VARIANCE, correct, predict
from cps_paper.testbed.robots.robot import advanced_arc, drive, wheel_target, wrapped
from cps_paper.testbed.robots.state import Rules, rules_of

QUIET = rules_of(RobotConfig(speed_noise_mps=0.0))
IDEAL = np.ones(2)
RADIUS = 1.5
RULES = rules_of(BASELINE)
DT, Q_HEADING, Q_SPEED, NOISE = 0.01, 0.3, 0.1, 0.0005
PROCESS = np.diag([1e-8, 1e-8, Q_HEADING**2 * DT, Q_SPEED**2 * DT])
SEEN = np.eye(2, 4)


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


def moved(state: np.ndarray, turning: float) -> np.ndarray:
    x, y, heading, speed = state
    return np.array([x + speed * np.cos(heading) * DT, y + speed * np.sin(heading) * DT, heading + turning * DT, speed])


def textbook(state: Array, covariance: Array, turning: float, seen: Array) -> tuple[Array, Array]:
    """An extended Kalman filter in matrices: numerical Jacobian, both measurements at once, Joseph's form."""
    steps = 1e-6 * np.eye(4)
    jacobian = np.column_stack([(moved(state + h, turning) - moved(state - h, turning)) / 2e-6 for h in steps])
    state, covariance = moved(state, turning), jacobian @ covariance @ jacobian.T + PROCESS
    gain = covariance @ SEEN.T @ np.linalg.inv(SEEN @ covariance @ SEEN.T + NOISE**2 * np.eye(2))
    rest = np.eye(4) - gain @ SEEN
    return state + gain @ (seen - state[:2]), rest @ covariance @ rest.T + NOISE**2 * gain @ gain.T


def test_it_is_the_textbook_s_filter() -> None:
    generator = np.random.default_rng(3)
    truth = np.array([1.5, 0.0, np.pi / 2, 0.25])
    ours, covariance = truth.copy(), INITIAL_VARIANCE * np.eye(4)
    theirs, expected = truth.copy(), covariance.copy()
    for _ in range(400):
        truth = moved(truth, 0.17)
        seen = truth[:2] + NOISE * generator.standard_normal(2)
        predict(ours, covariance, 0.17, RULES)
        correct(ours, covariance, seen[0], seen[1], RULES)
        theirs, expected = textbook(theirs, expected, 0.17, seen)
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(covariance, expected, rtol=1e-4, atol=1e-10)
        np.testing.assert_array_equal(covariance, covariance.T)


def test_its_covariance_tells_the_truth() -> None:
    """Normalised squared errors over runs of the filter's own model: chi-squared with four degrees of freedom."""
    generator, squares = np.random.default_rng(0), []
    for _ in range(60):
        truth = np.array([1.5, 0.0, np.pi / 2, 0.25])
        covariance = 1e-6 * np.eye(4)
        estimate = truth + 1e-3 * generator.standard_normal(4)
        for step in range(200):
            truth = moved(truth, 0.17) + np.sqrt(np.diag(PROCESS)) * generator.standard_normal(4)
            predict(estimate, covariance, 0.17, RULES)
            correct(estimate, covariance, *(truth[:2] + NOISE * generator.standard_normal(2)), RULES)
            if step % 20 == 19:
                error = truth - estimate
                squares.append(error @ np.linalg.solve(covariance, error))
    assert np.mean(squares) == pytest.approx(4.0, abs=0.45)  # 600 of standard deviation 2.83, hardly correlated
    assert np.mean(np.array(squares) > 9.488) == pytest.approx(0.05, abs=0.03)


def test_it_finds_a_speed_that_it_was_not_told() -> None:
    truth = np.array([1.5, 0.0, np.pi / 2, 0.25])
    estimate, covariance = np.array([1.5, 0.0, np.pi / 2, 0.0]), INITIAL_VARIANCE * np.eye(4)
    for _ in range(300):
        truth = moved(truth, 0.0)
        predict(estimate, covariance, 0.0, RULES)
        correct(estimate, covariance, truth[0], truth[1], RULES)
    np.testing.assert_allclose(estimate, truth, atol=1e-3)
