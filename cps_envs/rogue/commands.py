"""The desired acceleration of an intact vehicle under each law (specification 4); the actuator limits it later.

Errors are those of section 2: `e` (m) and `d` (m/s) are positive where the vehicle should drive faster.
"""

from __future__ import annotations

from math import sqrt

from cps_envs.rogue.kernel import Record, clip, kernel

NARROWEST_M = 0.1  # least gap that a human driver reckons with
DRIVER_EXPONENT = 4
RETURN_GAINS = (0.1, 1.0)  # 1/s2, 1/s: of a human leader who drives back to the reference
RETURN_LIMITS = (-3.0, 2.0)  # m/s2


@kernel
def linear(e: float, d: float, r: Record) -> float:
    """The law (5.15), m/s2, for the errors of both sides added up."""
    return float(r.proportional_gain * e + r.derivative_gain * d)


@kernel
def sliding(e: float, d: float, authority: float, r: Record) -> float:
    """The law S of (5.9) to (5.11), m/s2: a saturated sliding mode with the authority a_m."""
    layer = r.boundary_layer_mps
    share = clip((r.surface_slope_per_s * e + d) / layer, -1.0, 1.0)
    return float(share * (r.surface_gain_mps2 + authority + layer))


@kernel
def scheduled_authority(e: float, d: float, r: Record) -> float:
    """a_m of (5.12) and (5.13), m/s2: smaller near the set-point, where 1 m/s counts as 1 m."""
    share, reduced = sqrt(e * e + d * d) / r.separation_m, 1.0
    if share < r.inner_share:
        reduced = r.inner_share
    elif share < r.middle_share:
        reduced = r.middle_share
    elif share < r.outer_share:
        reduced = r.outer_share
    return float(reduced * r.max_acceleration_mps2)


@kernel
def drive_behind(distance: float, rate: float, speed: float, desired_speed: float, r: Record) -> float:
    """The human driver of (2.5), m/s2, `distance` between centres and `rate` (its derivative) to the vehicle ahead."""
    gap = max(distance - r.vehicle_length_m, NARROWEST_M)
    root = 2.0 * sqrt(r.driver_acceleration_mps2 * r.driver_braking_mps2)
    wanted = max(0.0, r.driver_gap_m + speed * (r.driver_headway_s - rate / root))
    return float(drive_freely(speed, desired_speed, r) - r.driver_acceleration_mps2 * (wanted / gap) ** 2)


@kernel
def drive_freely(speed: float, desired_speed: float, r: Record) -> float:
    """The human driver of (2.5) on an empty road, m/s2."""
    return float(r.driver_acceleration_mps2 * (1.0 - (speed / desired_speed) ** DRIVER_EXPONENT))


@kernel
def drive_back(e: float, d: float) -> float:
    """A human leader who recovers the position of the reference too, m/s2."""
    return clip(RETURN_GAINS[0] * e + RETURN_GAINS[1] * d, RETURN_LIMITS[0], RETURN_LIMITS[1])
