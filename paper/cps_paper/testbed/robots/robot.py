"""A robot: two wheels that follow their targets with a lag, and the pose that they drive."""

from __future__ import annotations

import math

from cps_envs.core.compute.kernels import clip, inlined
from cps_envs.core.types import FloatArray
from cps_paper.testbed.robots.state import Rules

MOVING_MPS = 0.005  # the speed is noisy above this


@inlined
def wrapped(angle: float) -> float:
    """The angle (rad) in [-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


@inlined
def wheel_target(speed: float, turning: float, side: float, rules: Rules) -> float:
    """Wheel speed (rad/s) for a robot's speed (m/s) and turning rate (rad/s); `side` is -1 left and 1 right."""
    target = (speed + side * turning * rules.wheel_base_m / 2.0) / rules.wheel_radius_m
    return clip(target, -rules.max_wheel_speed, rules.max_wheel_speed)


@inlined
def drive(
    pose: FloatArray,
    wheels: FloatArray,
    gains: FloatArray,
    speed_order: float,
    turning_order: float,
    draw: float,
    rules: Rules,
) -> float:
    """One plant step of a robot under an order; returns its speed (m/s). `draw` is a standard normal number."""
    share = rules.dt_s / rules.wheel_lag_s
    for wheel in range(2):
        target = wheel_target(speed_order, turning_order, 2.0 * wheel - 1.0, rules) * gains[wheel]
        wheels[wheel] += share * (target - wheels[wheel])
    speed = rules.wheel_radius_m * (wheels[0] + wheels[1]) / 2.0
    if speed > MOVING_MPS:
        speed += rules.speed_noise_mps * draw
    turning = rules.wheel_radius_m * (wheels[1] - wheels[0]) / rules.wheel_base_m
    heading = pose[2]
    pose[0] += rules.dt_s * speed * math.cos(heading)
    pose[1] += rules.dt_s * speed * math.sin(heading)
    pose[2] = heading + rules.dt_s * turning
    return float(speed)


@inlined
def advanced_arc(arc: float, x: float, y: float, radius: float) -> float:
    """The arc position (m) of a point near the last one, `arc`: the radius times the unwrapped angle."""
    return arc + radius * wrapped(math.atan2(y, x) - arc / radius)
