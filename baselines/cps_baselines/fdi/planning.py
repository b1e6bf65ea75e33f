"""Plans of injections that a kernel changes at random and plays in the model of the platoon, to keep the better ones.

A plan is a share for each step: where its injection lies between the lowest and the highest legal level. So a plan
stays legal when what comes before it changes, and fits other starts and gains. Levels that would force a neighbour
beyond its limits one step later do not count as legal; what remains of such excesses costs a penalty.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.injection import View
from cps_envs.core.compute.kernels import borrowed, clip, inlined, kernel, unpack
from cps_envs.core.types import Array, FloatArray, IntArray
from cps_envs.fdi.state import Constants

TOLERANCE = 2e-5  # m, m/s and m/s2 kept from every limit: observations are rounded
TOO_EARLY_MPS = 10.0  # what a collision of another pair costs
EXCESS_S = 60.0  # m/s for each m/s2 by which a neighbour's command exceeds its limits
MULTIPLIER, INCREMENT, MODULUS = 1103515245, 12345, 2**31  # of the random numbers


class Habits(NamedTuple):
    """How a search by annealing changes and compares plans; the last six say how often a kind of change is tried."""

    missed: float  # m/s for each metre that the target's gap is from closed at the end
    hottest: float  # m/s by which a change may make a plan worse, at first
    coldest: float  # and at last
    stride: float  # of a share, by which a change moves it at most
    longest: float  # steps of a changed stretch, at most
    one: float  # one share moves
    stretch: float  # a stretch moves
    beside: float  # a stretch becomes what is beside it
    edge: float  # a stretch becomes as low or as high as may be
    later: float  # what follows comes a step later
    sooner: float  # or sooner


class PlanningModel(NamedTuple):
    """The model of an episode's platoon in which plans are tried."""

    gain_p: float  # k_p, 1/s2
    gain_d: float  # k_d, 1/s
    dt_s: float
    low_mps2: float
    high_mps2: float
    gap_m: float
    vehicle: int  # whose sensor is attacked, from 0
    target: int  # from 0
    is_range: bool
    resolution: float  # m or m/s
    levels: int  # largest


@kernel
def improve_plans(
    constants: Array,
    views: View,
    gains: FloatArray,
    table: Array,
    counts: IntArray,
    plans: FloatArray,
    draws: IntArray,
    levels: IntArray,
) -> None:
    """Improve the plans (B, horizon) from the present step on, and fill the levels (B,) to inject now.

    Args:
        constants: (1,) records of `state.Constants`.
        views: what the attacker sees of B episodes.
        gains: (B, 2) k_p and k_d.
        table: (B,) records of `Habits`.
        counts: (B,) plans to try.
        plans: shares, in place.
        draws: (B,) states of the random numbers, in place.
        levels: filled.
    """
    c, n = unpack(Constants, constants, 0), views.error.shape[1] // 2
    size = 2 * n + 1
    path, trial, command = np.zeros((c.horizon + 1, size)), np.zeros((c.horizon + 1, size)), np.zeros(n)
    plan, other = np.zeros(c.horizon), np.zeros(c.horizon)
    for b in range(levels.size):
        p, habits, left = platoon_of(c, views, gains, b), unpack(Habits, table, b), c.horizon - views.step[b]
        best, draw = borrowed(plans)[b, views.step[b] :], borrowed(draws)[b : b + 1]
        plan[:left] = best
        path[0, : size - 1], path[0, size - 1] = views.error[b], 0.0
        trial[0] = path[0]
        cost = play(p, plan, path, 0, left, habits.missed, command)
        least, cooling = cost, habits.coldest / habits.hottest
        for number in range(counts[b]):
            heat = habits.hottest * cooling ** (number / counts[b])
            other[:left] = plan[:left]
            first = change(habits, other, left, draw)
            trial[: first + 1] = path[: first + 1]
            found = play(p, other, trial, first, left, habits.missed, command)
            if found <= cost - heat * math.log(drawn(draw)):
                plan, other, path, trial, cost = other, plan, trial, path, found
                if cost < least:
                    least = cost
                    best[:] = plan[:left]
        levels[b] = level_of(p, path[0], best[0], command)


@inlined
def platoon_of(c: Constants, views: View, gains: FloatArray, b: int) -> PlanningModel:
    """The platoon of an episode with one attacked sensor."""
    n, sensor = views.error.shape[1] // 2, 0
    while not views.attacked[b, sensor]:
        sensor += 1
    ranges = sensor < n
    return PlanningModel(
        gains[b, 0],
        gains[b, 1],
        c.dt_s,
        c.min_acceleration_mps2 + TOLERANCE,
        c.max_acceleration_mps2 - TOLERANCE,
        c.desired_gap_m,
        sensor % n,
        views.target[b],
        ranges,
        c.range_resolution_m if ranges else c.rate_resolution_mps,
        c.range_levels if ranges else c.rate_levels,
    )


@inlined
def drawn(draw: IntArray) -> float:
    """A random number above 0 and at most 1."""
    draw[0] = (draw[0] * MULTIPLIER + INCREMENT) % MODULUS
    return float((draw[0] // 2**8 + 1) / (MODULUS // 2**8))


@inlined
def below(draw: IntArray, bound: int) -> int:
    """A random whole number from 0 to `bound` - 1."""
    return min(int(drawn(draw) * bound), bound - 1)


@inlined
def change(habits: Habits, plan: FloatArray, left: int, draw: IntArray) -> int:
    """Change the first `left` shares of a plan in place; returns the first step that is changed."""
    first = below(draw, left)
    last = min(first + below(draw, max(int(habits.longest), 1)), left - 1)
    moved = habits.stride * (2.0 * drawn(draw) - 1.0) * drawn(draw)
    moves, copies = habits.one + habits.stretch, habits.beside + habits.edge
    kind = drawn(draw) * (moves + copies + habits.later + habits.sooner)
    if kind < moves:
        for k in range(first, (first if kind < habits.one else last) + 1):
            plan[k] = clip(plan[k] + moved, 0.0, 1.0)
    elif kind < moves + habits.beside:
        plan[first : last + 1] = plan[first - 1 if moved < 0.0 and first > 0 else min(last + 1, left - 1)]
    elif kind < moves + copies:
        plan[first : last + 1] = 0.0 if moved < 0.0 else 1.0
    elif kind < moves + copies + habits.later:
        for k in range(left - 1, first, -1):
            plan[k] = plan[k - 1]
    else:
        for k in range(first, left - 1):
            plan[k] = plan[k + 1]
    return first


@inlined
def play(
    p: PlanningModel,
    plan: FloatArray,
    path: FloatArray,
    first: int,
    left: int,
    missed: float,
    command: FloatArray,
) -> float:
    """Play a plan from a step on; returns its cost in m/s: minus the impact speed, and penalties.

    `path` (horizon + 1, 2n + 1) are errors, and the excess so far in m/s2, known up to `first`.
    """
    n, touch_m = command.size, p.gap_m - TOLERANCE
    for k in range(first, left + 1):
        row = path[k]
        cost = EXCESS_S * row[2 * n]
        if k > 0 and row[p.target] <= -p.gap_m - TOLERANCE:
            return float(cost + row[n + p.target])
        early = False
        for i in range(n):
            early |= k > 0 and row[i] <= -touch_m
        if early or k == left:
            return float(cost + missed * max(row[p.target] + p.gap_m, 0.0) + (TOO_EARLY_MPS if early else 0.0))
        move(p, row, level_of(p, row, plan[k], command), command, path[k + 1])
    return math.inf


@inlined
def level_of(p: PlanningModel, row: FloatArray, share: float, command: FloatArray) -> int:
    """The level of a share at the errors (2n + 1,); fills the commands (n,) without it, in m/s2."""
    n = command.size
    behind = 0.0
    for i in range(n):
        pull = p.gain_p * row[i] + p.gain_d * row[n + i]
        command[i] = pull - behind
        behind = pull
    effect = (p.gain_p if p.is_range else p.gain_d) * p.resolution
    low = max(-float(p.levels), math.ceil((p.low_mps2 - command[p.vehicle]) / effect))
    high = min(float(p.levels), math.floor((p.high_mps2 - command[p.vehicle]) / effect))
    if p.is_range:
        low = max(low, math.ceil((TOLERANCE - p.gap_m - row[p.vehicle]) / p.resolution))
    for i in (p.vehicle - 1, p.vehicle + 1):
        if 0 <= i < n:
            least, most = ahead_of(p, row, i, effect, command)
            low, high = (max(low, min(least, high)), min(high, max(most, low)))
    return int(low + math.floor(share * max(high - low, 0.0) + 0.5))


@inlined
def ahead_of(p: PlanningModel, row: FloatArray, i: int, effect: float, command: FloatArray) -> tuple[float, float]:
    """The levels between which a neighbour's next command stays within its limits; `effect` is that of a level."""
    n, total = command.size, 0.0
    for pair in (i - 1, i):
        if pair >= 0:
            pushed = (command[pair + 1] if pair + 1 < n else 0.0) - command[pair]
            gap = row[pair] + p.dt_s * (row[n + pair] + p.dt_s / 2 * pushed)
            pull = p.gain_p * gap + p.gain_d * (row[n + pair] + p.dt_s * pushed)
            total += pull if pair == i else -pull
    slope = effect * p.dt_s * (p.gain_p * p.dt_s / 2 + p.gain_d)
    return math.ceil((p.low_mps2 - total) / slope), math.floor((p.high_mps2 - total) / slope)


@inlined
def move(p: PlanningModel, row: FloatArray, level: int, command: FloatArray, after: FloatArray) -> None:
    """The next errors, and the excess, after injecting a level; `command` are those without it."""
    n = command.size
    command[p.vehicle] += (p.gain_p if p.is_range else p.gain_d) * p.resolution * level
    after[2 * n] = row[2 * n]
    for i in range(n):
        after[2 * n] += max(0.0, p.low_mps2 - command[i], command[i] - p.high_mps2)
        pushed = (command[i + 1] if i + 1 < n else 0.0) - command[i]
        after[i] = row[i] + p.dt_s * (row[n + i] + p.dt_s / 2 * pushed)
        after[n + i] = row[n + i] + p.dt_s * pushed
