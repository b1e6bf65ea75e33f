"""The robots as plain arrays that numba kernels work on in place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cps_envs.disbanding.testbed.config import RobotConfig

Floats = NDArray[np.float64]


class Robots(NamedTuple):
    """B episodes of M robots, numbered front to rear as the vehicles of a `disbanding.state.State`.

    What the controllers know of the robots is such a State, filled from the filters' estimates and as large as the road
    (`RobotConfig.scale`); what follows is in the robots' own metres.
    """

    pose: Floats  # (B, M, 3) x in m, y in m, heading in rad
    arc: Floats  # (B, M) m, distance along the circle, unwrapped
    speed: Floats  # (B, M) m/s
    wheels: Floats  # (B, M, 2) rad/s, left and right
    gains: Floats  # (B, M, 2) errors of the wheels' drives, 1 = none
    estimate: Floats  # (B, M, 4) x in m, y in m, heading in rad, speed in m/s
    covariance: Floats  # (B, M, 4, 4) of the estimate
    orders: Floats  # (B, D + 1, M, 2) speed in m/s and turning rate in rad/s; decided last, ..., acting now
    integral: Floats  # (B, M) m, of the speed loop
    noise: Floats  # (B, K, M, 3) standard normal draws of each plant step: speed, camera's x and y
    error: Floats  # (B, M) m/s, sum of |V - v_d| in the window of E_v
    speeds: Floats  # (B, P + 1, M) m/s, at the start and the end of each control period
    arcs: Floats  # (B, P + 1, M) m, likewise


def allocate(config: RobotConfig, num_envs: int) -> Robots:
    """Robots with every array zero; `start.place_robots` fills the episodes."""
    envs, robots, periods = num_envs, config.num_robots, config.num_periods
    return Robots(
        pose=np.zeros((envs, robots, 3)),
        arc=np.zeros((envs, robots)),
        speed=np.zeros((envs, robots)),
        wheels=np.zeros((envs, robots, 2)),
        gains=np.ones((envs, robots, 2)),
        estimate=np.zeros((envs, robots, 4)),
        covariance=np.zeros((envs, robots, 4, 4)),
        orders=np.zeros((envs, config.delay_periods + 1, robots, 2)),
        integral=np.zeros((envs, robots)),
        noise=np.zeros((envs, periods * config.steps_per_period, robots, 3)),
        error=np.zeros((envs, robots)),
        speeds=np.zeros((envs, periods + 1, robots)),
        arcs=np.zeros((envs, periods + 1, robots)),
    )
