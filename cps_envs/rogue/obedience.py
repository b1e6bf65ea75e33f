"""What vehicles have been told to do, and how far they do something else: kernels of `monitor`."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import Record, clip, inlined
from cps_envs.core.types import Array, FloatArray
from cps_envs.rogue.actions import Body, body_of
from cps_envs.rogue.controllers import DRIVEN, HUMAN, LINEAR, REAR, SLIDING, drive_behind, drive_freely, linear, sliding
from cps_envs.rogue.state import Rules


@inlined
def strength(speed: float, acceleration: float, e: Body) -> float:
    """How far (m/s2) an acceleration is beyond that of an intact engine at full effort, on the nearer side."""
    drag = e.drag_per_s * speed
    most, least = e.drive_mps2 * e.max_effort - drag, e.drive_mps2 * e.min_effort - drag
    return float(max(acceleration - most, least - acceleration))


@inlined
def disobedience(
    values: FloatArray,
    at: Record,
    i: int,
    count: int,
    commanded_mps2: float,
    margin_mps: float,
    r: Rules,
    bodies: Array,
) -> float:
    """How far (m/s2) the acceleration of vehicle `i` lies outside what it was commanded.

    Where that is NaN, outside what its law asks for, with rates off by up to the margin.
    """
    done, speed, e = values[at.acceleration + i], max(values[at.speed + i], 0.0), body_of(bodies, i)
    if not np.isnan(commanded_mps2):
        return float(abs(done - within(commanded_mps2, speed, r, e)))
    least = within(wanted(values, at, i, count, -margin_mps, r, bodies), speed, r, e)
    most = within(wanted(values, at, i, count, margin_mps, r, bodies), speed, r, e)
    return float(max(least - done, done - most, 0.0))


@inlined
def within(wanted_mps2: float, speed: float, r: Rules, e: Body) -> float:
    """The acceleration (m/s2) next to the wanted one that the engine of an intact vehicle has at a speed."""
    effort = clip((wanted_mps2 + e.drag_per_s * speed) / e.drive_mps2, r.min_effort, r.max_effort)
    return float(e.drive_mps2 * effort - e.drag_per_s * speed)


@inlined
def wanted(values: FloatArray, at: Record, i: int, count: int, shift_mps: float, r: Rules, bodies: Array) -> float:
    """The acceleration (m/s2) that the law in force wants, as in `dynamics.decide`."""
    ahead, behind = at.gap_error + i, at.gap_error + i - 1
    rates = at.gap_rate - at.gap_error
    speed, leads, trails = values[at.speed + i], i == count - 1, i == 0
    front_e = values[at.reference_error] if leads else values[ahead]
    front_d = values[at.reference_speed] - speed if leads else values[ahead + rates]
    rear_e = 0.0 if trails else values[behind]
    rear_d = 0.0 if trails else values[behind + rates]
    law, growth = law_of(values, at, i), values[at.growth + i]
    if law == LINEAR:
        e = body_of(bodies, i)
        return linear(front_e - rear_e, front_d - rear_d + shift_mps, e.proportional_gain, e.derivative_gain)
    if law == SLIDING:
        return sliding(front_e - rear_e, front_d - rear_d + shift_mps, r.max_acceleration_mps2, r)
    if law == REAR:
        error = 0.0 if trails else growth - rear_e
        return sliding(error, shift_mps - rear_d, r.max_acceleration_mps2, r)
    if law == HUMAN:
        if leads:
            return drive_freely(speed, values[at.reference_speed] + shift_mps, r)
        lengths_m = 0.5 * (body_of(bodies, i).length_m + body_of(bodies, i + 1).length_m)
        bumpers_m = front_e + r.separation_m - lengths_m
        return drive_behind(bumpers_m, front_d + shift_mps, speed, values[at.reference_speed], r)
    return sliding(front_e if leads else front_e - growth, front_d + shift_mps, r.max_acceleration_mps2, r)


@inlined
def law_of(values: FloatArray, at: Record, i: int) -> int:
    """The law in force of vehicle `i`."""
    first, law = at.law + i * len(DRIVEN), 0
    for k in range(1, len(DRIVEN)):
        law = k if values[first + k] > values[first + law] else law
    return law
