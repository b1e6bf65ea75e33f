"""Which injections are legal, (3.48) to (3.50), as an interval of levels for each attacked sensor.

A level is an injection in units of the sensor's resolution. What a set of sensors may do together is a polytope; each
row `base + sum(coefficient * level)` within bounds. An interval here is what a row leaves to one sensor when the other
sensors help as much as they can: exact for one sensor, and for two of one vehicle up to rounding to levels.

A vehicle's own command depends on its own two sensors alone, so that the cost is linear in the number of vehicles.
"""

from __future__ import annotations

import math

from cps_envs.core.compute.kernels import fill, inlined
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.controller import feedback
from cps_envs.fdi.state import Constants, Scratch

SLACK = 1e-7  # of every test of legality and of collision, m/s2 and m
MASK_SLACK = SLACK / 2  # so that rounding never makes an offered injection illegal


@inlined
def legal_levels(error: FloatArray, c: Constants, sensors: IntArray, interval: IntArray, s: Scratch) -> bool:
    """Fill the intervals (S, 2) at the error (2n,).

    Returns False where nothing is legal: a vehicle that nobody attacks has to exceed its limits, or an interval is
    empty. `s.slot` has to be that of the sensors, see `place`.
    """
    n = error.size // 2
    for slot in range(sensors.size):
        set_box(error, c, sensors[slot], slot, interval)
    possible = True
    if c.limit_commands and not c.clips:
        for i in range(n):
            if cut_own(error, c, i, interval, s):
                continue
            possible &= inside(feedback(error, c, i), c)
    for slot in range(sensors.size):
        possible &= interval[slot, 0] <= interval[slot, 1]
    return possible


@inlined
def legal_in_slot(
    error: FloatArray, c: Constants, sensors: IntArray, slot: int, interval: IntArray, s: Scratch
) -> None:
    """Fill the interval of an attacked slot, where `s.level` of the slots before it is fixed; see `legal_levels`."""
    if c.filters:
        set_box(error, c, sensors[slot], slot, interval)
        return
    n = error.size // 2
    i = sensors[slot] % n
    for sensor in (i, n + i):
        own = s.slot[sensor]
        if own >= 0:
            set_box(error, c, sensor, own, interval)
            if own < slot:
                interval[own, 0] = interval[own, 1] = s.level[own]
    if c.limit_commands and not c.clips:
        cut_own(error, c, i, interval, s)


@inlined
def place(sensors: IntArray, slot: IntArray) -> None:
    """Fill the slot (R,) of each reading, -1 where it is not attacked; `sensors` (S,) are readings or -1."""
    fill(slot, -1)
    for s in range(sensors.size):
        if sensors[s] >= 0:
            slot[sensors[s]] = s


@inlined
def set_box(error: FloatArray, c: Constants, sensor: int, slot: int, interval: IntArray) -> None:
    """The levels that (3.48) and (3.50) leave to a sensor, the index of a reading; none but 0 where it is -1.

    With a filter injections are for the next readings, which nobody knows yet: (3.50) then clips those.
    """
    levels = c.range_levels if sensor < c.readings // 2 else c.rate_levels
    interval[slot, 0], interval[slot, 1] = -levels, levels
    if sensor < 0:
        interval[slot, 0], interval[slot, 1] = 0, 0
    elif sensor < c.readings // 2 and c.limit_readings and not c.filters:
        lowest = math.ceil((-c.desired_gap_m - error[sensor] - MASK_SLACK) / c.range_resolution_m)
        interval[slot, 0] = max(interval[slot, 0], lowest)


@inlined
def cut_own(error: FloatArray, c: Constants, i: int, interval: IntArray, s: Scratch) -> bool:
    """Shrink the intervals of a vehicle's own sensors so that its command (3.49) stays possible; False: it has none."""
    n, count = error.size // 2, 0
    for sensor in (i, n + i):
        gain = c.proportional_gain if sensor < n else c.derivative_gain
        effect = gain * resolution(c, sensor, n)
        if s.slot[sensor] >= 0 and effect != 0:
            s.row[count], s.which[count] = effect, s.slot[sensor]
            count += 1
    if count > 0:
        cut(feedback(error, c, i), c, s.row[:count], s.which[:count], interval)
    return count > 0


@inlined
def cut(base: float, c: Constants, row: FloatArray, which: IntArray, interval: IntArray) -> None:
    """Shrink the intervals `which` (k,) so that base + row (k,) @ levels can stay within the limits of acceleration."""
    low, high = 0.0, 0.0  # of row @ levels
    for k in range(row.size):
        a, b = row[k] * interval[which[k], 0], row[k] * interval[which[k], 1]
        low += min(a, b)
        high += max(a, b)
    least = c.min_acceleration_mps2 - MASK_SLACK - base - high
    most = c.max_acceleration_mps2 + MASK_SLACK - base - low
    for k in range(row.size):
        slot = which[k]
        a, b = row[k] * interval[slot, 0], row[k] * interval[slot, 1]
        if row[k] > 0:
            interval[slot, 0] = max(interval[slot, 0], math.ceil((least + b) / row[k]))
            interval[slot, 1] = min(interval[slot, 1], math.floor((most + a) / row[k]))
        elif row[k] < 0:
            interval[slot, 0] = max(interval[slot, 0], math.ceil((most + b) / row[k]))
            interval[slot, 1] = min(interval[slot, 1], math.floor((least + a) / row[k]))


@inlined
def choose_levels(action: IntArray, error: FloatArray, c: Constants, sensors: IntArray, s: Scratch) -> None:
    """Fill `s.level` (S,) from an action (S,): a level plus its bound. Clipped limits take the nearest possible one."""
    for slot in range(sensors.size):
        if sensors[slot] < 0:
            s.level[slot] = 0
            continue
        wish = action[slot] - (c.range_levels if sensors[slot] < c.readings // 2 else c.rate_levels)
        if c.clips:
            set_box(error, c, sensors[slot], slot, s.interval)
            low, high = s.interval[slot, 0], s.interval[slot, 1]
            if low <= high:
                wish = nearest(wish, low, high)
        s.level[slot] = wish


@inlined
def inside(command: float, c: Constants) -> bool:
    """Whether an acceleration lies within the limits (3.49), with slack."""
    return c.min_acceleration_mps2 - SLACK <= command <= c.max_acceleration_mps2 + SLACK


@inlined
def resolution(c: Constants, sensor: int, ranges: int) -> float:
    """Of a sensor, m or m/s; so many `ranges` come before the range-rates."""
    return c.range_resolution_m if sensor < ranges else c.rate_resolution_mps


@inlined
def nearest(level: int, low: int, high: int) -> int:
    """The level itself where it lies in the interval, else the nearest end."""
    return max(low, min(high, level))
