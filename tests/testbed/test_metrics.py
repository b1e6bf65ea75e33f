from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.kernels import view
from cps_envs.testbed.config import BASELINE
from cps_envs.testbed.payoff import METRICS, measure_episode, velocity_error
from cps_envs.testbed.state import Robots, allocate, rules_of

INTACT = np.array([False] * 3 + [True] * 6)


def robots() -> Robots:
    """One environment in which robots drive at 0.25 m/s with gaps of 0.35 m for 60 s."""
    made = allocate(BASELINE, 1)
    made.speeds[:] = 0.25
    made.arcs[:] = 0.25 * 0.05 * np.arange(1201)[:, np.newaxis] - 0.35 * np.arange(9)
    return made


def measured(made: Robots, period: int = 1200) -> dict[str, float]:
    error = velocity_error(made.error[0], np.array([20.0, np.inf, np.inf]), rules_of(BASELINE))
    return dict(zip(METRICS, [error, *measure_episode(view(made, 0), period, INTACT, BASELINE)], strict=True))


def test_steady_driving() -> None:
    assert measured(robots()) == pytest.approx(
        {
            "velocity_error": 0.0,
            "lowest_speed_mps": 0.25,
            "stopped": 0.0,
            "smallest_gap_m": 0.35,
            "collided": 0.0,
            "rms_acceleration_mps2": 0.0,
        }
    )


def test_what_happens_before_the_window_or_to_the_disbanded_does_not_count() -> None:
    made = robots()
    made.speeds[0, :400, 5] = 0.0
    made.speeds[0, :, :3] = 0.0
    made.error[0, :3] = 1e6
    made.arcs[0, :400, 5] += 0.2
    made.arcs[0, :, 1] += 0.3  # robot 8 near robot 9
    assert measured(made) == measured(robots())


def test_events_in_the_window() -> None:
    made = robots()
    made.speeds[0, 500:520, 8] = 0.005
    made.speeds[0, 510, 7] = 0.02
    made.arcs[0, 700, 6] += 0.26
    found = measured(made)
    assert found["lowest_speed_mps"] == 0.005
    assert found["stopped"] == 1
    assert found["smallest_gap_m"] == pytest.approx(0.09)
    assert found["collided"] == 1
    squares = 2 * (0.245 / 0.05) ** 2 + 2 * (0.23 / 0.05) ** 2
    assert found["rms_acceleration_mps2"] == pytest.approx(np.sqrt(squares / (6 * 600)))
    assert measured(made, 499)["stopped"] == 0


def test_velocity_error_is_the_mean_relative_error_in_percent() -> None:
    made = robots()
    made.error[0, 3:] = 600 * 0.05  # every sample of the window is off by 0.05 m/s
    assert measured(made)["velocity_error"] == pytest.approx(20.0)
    made.error[0, 3:6] = 0.0
    assert measured(made)["velocity_error"] == pytest.approx(10.0)
