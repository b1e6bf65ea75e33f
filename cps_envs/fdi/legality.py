"""Which injections are legal, (3.48) to (3.50), as an interval of levels for each attacked sensor.

A level is an injection in units of the sensor's resolution. What a set of sensors may do together is a polytope; each
row `base + sum(coefficient * level)` within bounds. An interval here is what a row leaves to one sensor when the other
sensors help as much as they can: exact for one sensor, and for two of one vehicle up to rounding to levels.
"""

from __future__ import annotations

import math

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.memory import Constants, Matrices, Memory

SLACK = 1e-7  # of every test of legality and of collision, m/s2 and m
MASK_SLACK = SLACK / 2  # so that rounding never makes an offered injection illegal


@inlined
def resolution(c: Constants, sensor: int, n: int) -> float:
    """Of a sensor, m or m/s."""
    return c.range_resolution_m if sensor < n else c.rate_resolution_mps


@inlined
def set_box(error: FloatArray, c: Constants, sensors: IntArray, interval: IntArray) -> None:
    """The levels (S, 2) that (3.48) and (3.50) leave; sensors (S,) are indices of readings, -1 where not attacked."""
    n = error.size // 2
    for s in range(sensors.size):
        sensor = sensors[s]
        levels = c.range_levels if sensor < n else c.rate_levels
        interval[s, 0], interval[s, 1] = -int(levels), int(levels)
        if sensor < 0:
            interval[s, 0], interval[s, 1] = 0, 0
        elif sensor < n and c.limit_readings > 0:
            lowest = math.ceil((-c.desired_gap_m - error[sensor] - MASK_SLACK) / c.range_resolution_m)
            interval[s, 0] = max(interval[s, 0], lowest)


@inlined
def cut(base: float, row: FloatArray, c: Constants, interval: IntArray) -> None:
    """Shrink the intervals (S, 2) so that base + row @ levels can stay within the limits of acceleration."""
    low, high = 0.0, 0.0  # of row @ levels
    for s in range(row.size):
        a, b = row[s] * interval[s, 0], row[s] * interval[s, 1]
        low += min(a, b)
        high += max(a, b)
    least = c.min_acceleration_mps2 - MASK_SLACK - base - high
    most = c.max_acceleration_mps2 + MASK_SLACK - base - low
    for s in range(row.size):
        a, b = row[s] * interval[s, 0], row[s] * interval[s, 1]
        if row[s] > 0:
            interval[s, 0] = max(interval[s, 0], math.ceil((least + b) / row[s]))
            interval[s, 1] = min(interval[s, 1], math.floor((most + a) / row[s]))
        elif row[s] < 0:
            interval[s, 0] = max(interval[s, 0], math.ceil((most + b) / row[s]))
            interval[s, 1] = min(interval[s, 1], math.floor((least + a) / row[s]))


@inlined
def legal_levels(
    memory: Memory,
    c: Constants,
    m: Matrices,
    sensors: IntArray,
    fixed: IntArray,
    num_fixed: int,
    interval: IntArray,
    row: FloatArray,
) -> bool:
    """Fill the intervals (S, 2) of an episode's present state; the first `num_fixed` levels are `fixed` already.

    Returns False where nothing is legal: a vehicle that nobody attacks has to exceed its limits, or an interval is
    empty. `row` (S,) is scratch.
    """
    n = memory.law.size
    set_box(memory.error, c, sensors, interval)
    for s in range(num_fixed):
        interval[s, 0] = interval[s, 1] = fixed[s]
    possible = True
    if c.limit_commands > 0 and c.clip == 0:
        for i in range(n):
            if fill_row(m.law, c, sensors, i, n, row):
                cut(memory.law[i], row, c, interval)
                continue
            possible &= inside(memory.law[i], c)
            if c.look_ahead > 0:
                fill_row(m.ahead, c, sensors, i, n, row)
                base = 0.0
                for j in range(2 * n):
                    base += m.ahead[j, i] * memory.error[j]
                cut(base, row, c, interval)
    for s in range(sensors.size):
        possible &= interval[s, 0] <= interval[s, 1]
    return possible


@inlined
def inside(command: float, c: Constants) -> bool:
    """Whether an acceleration lies within the limits (3.49), with slack."""
    return c.min_acceleration_mps2 - SLACK <= command <= c.max_acceleration_mps2 + SLACK


@inlined
def fill_row(matrix: FloatArray, c: Constants, sensors: IntArray, i: int, n: int, row: FloatArray) -> bool:
    """Coefficients (S,) of the levels in output i of a matrix [state, readings]; whether there are any but zero."""
    some = False
    for s in range(sensors.size):
        sensor = sensors[s]
        row[s] = matrix[2 * n + sensor, i] * resolution(c, sensor, n) if sensor >= 0 else 0.0
        some |= row[s] != 0
    return some


@inlined
def nearest(level: int, low: int, high: int) -> int:
    """The level itself where it lies in the interval, else the nearest end."""
    return max(low, min(high, level))
