"""The numbers of section 2.5, read from the robots' true speeds and places."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import BoolArray, FloatArray
from cps_paper.testbed.robots.config import RobotConfig
from cps_paper.testbed.robots.state import Robots, Rules

STOP_MPS = 0.01  # a robot stops when it gets slower than this
METRICS = (
    "velocity_error",  # percent, (2.8) over the robots of platoons never disbanded, so far
    "lowest_speed_mps",  # of these robots, from the start of the window on
    "stopped",  # of these, how many stopped, from the start of the window on
    "smallest_gap_m",  # ahead of them, centre to centre, from the start of the window on
    "collided",  # of them, how many were nearer than a body's length to the robot ahead at some time
    "rms_acceleration_mps2",  # of them, in the window
)


@inlined
def velocity_error(error: FloatArray, disbanding_s: FloatArray, rules: Rules) -> float:
    """E_v (2.8) of an episode in percent over the robots of intact platoons; it grows over the window.

    `error` (M,) is the sum of |V - v_d| in m/s, `disbanding_s` (N,) is infinite for intact platoons.
    """
    samples, size = rules.window_last - rules.window_first, error.size // disbanding_s.size
    total, intact = 0.0, 0
    for q in range(error.size):
        if disbanding_s[q // size] == np.inf:
            total += error[q]
            intact += 1
    return 100.0 * total / (samples * rules.desired_speed_mps * max(intact, 1))


def measure_episode(robots: Robots, period: int, intact: BoolArray, config: RobotConfig) -> FloatArray:
    """All METRICS but the first of an episode after so many control periods, for its intact robots (M,)."""
    first, last = config.window
    speeds, arcs = robots.speeds[: period + 1], robots.arcs[: period + 1]
    since = slice(min(first, period), None)
    slowest = speeds[since, intact].min(axis=0, initial=np.inf)
    behind = intact[1:]  # the front robot has nobody ahead
    gaps = -np.diff(arcs, axis=1)[:, behind]
    changes = np.diff(speeds[min(first, period) : last + 1, intact], axis=0) / config.control_period_s
    return np.array(
        [
            slowest.min(initial=config.max_speed_mps),
            np.sum(slowest < STOP_MPS),
            gaps[since].min(initial=2 * np.pi * config.radius_m),
            np.sum(gaps.min(axis=0, initial=np.inf) < config.body_length_m),
            np.sqrt(np.mean(changes**2)) if changes.size else 0.0,
        ]
    )
