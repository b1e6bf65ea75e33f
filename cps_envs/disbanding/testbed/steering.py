"""What a robot is ordered: a turning rate by pure pursuit of the circle, a speed by the PI loop."""

from __future__ import annotations

import math

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.commands import clip
from cps_envs.disbanding.testbed.robot import wrapped
from cps_envs.disbanding.testbed.rules import Rules
from cps_envs.disbanding.testbed.state import Floats


@kernel
def pursue(estimate: Floats, rules: Rules) -> float:
    """Turning rate (rad/s) towards the point of the circle `lookahead_m` of arc ahead of an estimate."""
    x, y, heading, speed = estimate[0], estimate[1], estimate[2], estimate[3]
    goal = math.atan2(y, x) + rules.lookahead_m / rules.radius_m
    across, along = rules.radius_m * math.cos(goal) - x, rules.radius_m * math.sin(goal) - y
    bearing = wrapped(math.atan2(along, across) - heading)
    return float(2.0 * max(speed, 0.0) * math.sin(bearing) / math.hypot(across, along))


@kernel
def order_speed(speed: float, acceleration: float, integral: Floats, robot: int, rules: Rules) -> float:
    """Speed order (m/s) of a robot for a wanted acceleration (m/s2); updates its entry of `integral` (M,)."""
    wanted = clip(speed + rules.control_period_s * acceleration, 0.0, rules.max_speed_mps)
    error = wanted - speed
    limit = rules.max_integral_m
    integral[robot] = clip(integral[robot] + rules.control_period_s * error, -limit, limit)
    order = wanted + rules.speed_gain * error + rules.speed_integral_gain * integral[robot]
    return clip(order, 0.0, rules.max_speed_mps)
