"""What the kernels need of a configuration, as plain numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

from cps_envs.disbanding.testbed.config import RobotConfig

LEAST_CAMERA_NOISE_M = 1e-4  # that the filter believes in
POSITION_DRIFT_M2 = 1e-8  # variance that the filter adds to x and y in each step


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
