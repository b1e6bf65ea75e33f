"""The controllers of an intact vehicle: the acceleration that each one wants (specification 4), limited later.

Errors are those of section 2: `e` (m) and `d` (m/s) are positive where the vehicle should drive faster.
"""

from __future__ import annotations

from math import sqrt

from cps_envs.core.compute.kernels import clip, inlined
from cps_envs.rogue.state import Rules

LINEAR = 0  # bidirectional proportional-derivative, (5.15)
SLIDING = 1  # sliding mode on both sides at once, (5.9) to (5.11)
FRONT = 2  # sliding mode on the front neighbour only; for the leader on its reference
REAR = 3  # sliding mode on the rear neighbour only; the rear vehicle has none and keeps its speed
HUMAN = 4  # a human driver, (2.5)
DETECTING = 5  # SLIDING until the vehicle's own alarm, then FRONT or REAR, whichever side raised it
COMMANDED = 6  # the acceleration that the defender commands

CONTROLLERS = ("linear", "sliding", "front", "rear", "human", "detecting")  # what the defender selects from
DRIVEN = CONTROLLERS[:DETECTING]  # what a vehicle can be seen to drive by

NARROWEST_M = 0.1  # least gap that a human driver reckons with
SLOWEST_MPS = 0.1  # m/s, that a human driver wants: who is to stand still creeps
DRIVER_EXPONENT = 4
RETURN_GAINS = (0.1, 1.0)  # 1/s2, 1/s: of a human leader who drives back to the reference
RETURN_LIMITS = (-3.0, 2.0)  # m/s2


@inlined
def in_force(ordered: int, alarm: int) -> int:
    """The controller that a vehicle drives by: `DETECTING` stands for one of three."""
    if ordered != DETECTING:
        return ordered
    return FRONT if alarm > 0 else REAR if alarm < 0 else SLIDING


@inlined
def linear(e: float, d: float, proportional_gain: float, derivative_gain: float) -> float:
    """The controller (5.15), m/s2, for the errors of both sides added up."""
    return proportional_gain * e + derivative_gain * d


@inlined
def sliding(e: float, d: float, authority: float, r: Rules) -> float:
    """The controller S of (5.9) to (5.11), m/s2: a saturated sliding mode with the authority a_m."""
    layer = r.boundary_layer_mps
    share = clip((r.surface_slope_per_s * e + d) / layer, -1.0, 1.0)
    return share * (r.surface_gain_mps2 + authority + layer)


@inlined
def scheduled_authority(e: float, d: float, r: Rules) -> float:
    """a_m of (5.12) and (5.13), m/s2: smaller near the set-point, where 1 m/s counts as 1 m."""
    share, reduced = sqrt(e * e + d * d) / r.separation_m, 1.0
    if share < r.inner_share:
        reduced = r.inner_share
    elif share < r.middle_share:
        reduced = r.middle_share
    elif share < r.outer_share:
        reduced = r.outer_share
    return reduced * r.max_acceleration_mps2


@inlined
def drive_behind(bumpers_m: float, rate: float, speed: float, desired_speed: float, r: Rules) -> float:
    """The human driver of (2.5), m/s2, `bumpers_m` behind the vehicle ahead; `rate` is the derivative of that."""
    gap = max(bumpers_m, NARROWEST_M)
    root = 2.0 * sqrt(r.driver_acceleration_mps2 * r.driver_braking_mps2)
    wanted = max(0.0, r.driver_gap_m + speed * (r.driver_headway_s - rate / root))
    return drive_freely(speed, desired_speed, r) - r.driver_acceleration_mps2 * (wanted / gap) ** 2


@inlined
def drive_freely(speed: float, desired_speed: float, r: Rules) -> float:
    """The human driver of (2.5) on an empty road, m/s2."""
    desired = max(desired_speed, SLOWEST_MPS)
    return float(r.driver_acceleration_mps2 * (1.0 - (speed / desired) ** DRIVER_EXPONENT))


@inlined
def drive_back(e: float, d: float) -> float:
    """A human leader who recovers the position of the reference too, m/s2."""
    return clip(RETURN_GAINS[0] * e + RETURN_GAINS[1] * d, RETURN_LIMITS[0], RETURN_LIMITS[1])
