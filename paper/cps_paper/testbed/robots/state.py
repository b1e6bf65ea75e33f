"""The robots as plain arrays that kernels work on in place, and the rules: what kernels need of a configuration."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.types import FloatArray
from cps_paper.testbed.robots.config import RobotConfig

LEAST_CAMERA_NOISE_M = 1e-4  # that the filter believes in
POSITION_DRIFT_M2 = 1e-8  # variance that the filter adds to x and y in each step


class Robots(NamedTuple):
    """B environments of M robots, numbered front to rear as the vehicles of a `disbanding.state.State`.

    What the controllers know of the robots is such a State, filled from the filters' estimates and as large as the road
    (`RobotConfig.scale`); what follows is in the robots' own metres.
    """

    pose: FloatArray  # (B, M, 3) x in m, y in m, heading in rad
    arc: FloatArray  # (B, M) m, distance along the circle, unwrapped
    speed: FloatArray  # (B, M) m/s
    wheels: FloatArray  # (B, M, 2) rad/s, left and right
    gains: FloatArray  # (B, M, 2) errors of the wheels' drives, 1 = none
    estimate: FloatArray  # (B, M, 4) x in m, y in m, heading in rad, speed in m/s
    covariance: FloatArray  # (B, M, 4, 4) of the estimate
    orders: FloatArray  # (B, D + 1, M, 2) speed in m/s and turning rate in rad/s; decided last, ..., acting now
    integral: FloatArray  # (B, M) m, of the speed loop
    noise: FloatArray  # (B, K, M, 3) standard normal draws of each plant step: speed, camera's x and y
    error: FloatArray  # (B, M) m/s, sum of |V - v_d| in the window of E_v
    speeds: FloatArray  # (B, P + 1, M) m/s, at the start and the end of each control period
    arcs: FloatArray  # (B, P + 1, M) m, likewise


class Rules(NamedTuple):
    """The quantities of `RobotConfig` with these names, and a few made from them."""

    scale: float
    dt_s: float
    control_period_s: float
    steps_per_period: int
    num_periods: int
    periods_per_attack: int  # control periods between two decisions of the attacker
    radius_m: float
    body_length_m: float
    desired_speed_mps: float
    max_speed_mps: float
    sudden_braking_mps2: float
    sudden_braking_s: float
    wheel_radius_m: float
    wheel_base_m: float
    wheel_lag_s: float
    max_wheel_speed: float
    speed_noise_mps: float
    camera_noise_m: float
    heading_drift: float
    speed_drift: float
    lookahead_m: float
    speed_gain: float
    speed_integral_gain: float
    max_integral_m: float
    avoids_always: bool
    window_first: int  # periods, see RobotConfig.window
    window_last: int
    camera_variance_m2: float  # that the filter believes in


def rules_of(config: RobotConfig) -> Rules:
    """The rules of a configuration."""
    first, last = config.window
    made: dict[str, Any] = {
        "avoids_always": config.avoidance == "always",
        "window_first": first,
        "window_last": last,
        "periods_per_attack": config.road.periods_per_second,
        "camera_variance_m2": max(config.camera_noise_m, LEAST_CAMERA_NOISE_M) ** 2,
    }
    return Rules(**made, **{name: getattr(config, name) for name in Rules._fields if name not in made})


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
