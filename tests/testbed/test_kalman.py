from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.types import Array
from cps_envs.testbed.config import BASELINE
from cps_envs.testbed.kalman import INITIAL_VARIANCE, correct, predict
from cps_envs.testbed.state import rules_of

RULES = rules_of(BASELINE)
DT, Q_HEADING, Q_SPEED, NOISE = 0.01, 0.3, 0.1, 0.0005
PROCESS = np.diag([1e-8, 1e-8, Q_HEADING**2 * DT, Q_SPEED**2 * DT])
SEEN = np.eye(2, 4)


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
