"""Better attacks by simulated annealing: plans are changed at a few places, and each is played as far as it is legal.

A plan is played with every injection moved to the nearest legal level. What a plan cannot mend, the commands of
vehicles that nobody attacks, costs a penalty. From rest waiting is free, so a collision at any step counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.replay import ROUNDING, NoReplayError, replay
from cps_envs.core.compute.kernels import inlined, kernel
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.task import Task

TOLERANCE = SLACK - 2 * ROUNDING  # of limits, so that a replay accepts what is accepted here
MISSED = 10.0  # m/s for each metre that is left of the gap at the end
EXCESS = 20.0  # m/s for each m/s2 that a command exceeds its limits
HOTTEST_MPS, COLDEST_MPS = 0.1, 3e-4  # by which a change may make a plan slower
PLACES = 4  # injections changed at a time, at most
ROUND = 100_000  # plans between two starts, in turn from the best plan and from no injection at all


class Platoon(NamedTuple):
    """The platoon of a task, ready for kernels. Slots are the q attacked sensors, ranges first."""

    feedback: FloatArray  # A_2 (n, 2n)
    transition: FloatArray  # A (2n, 2n)
    effect: FloatArray  # (q, 2n) what a level changes of the next errors
    command: FloatArray  # (q,) what a level changes of its vehicle's command, m/s2
    resolution: FloatArray  # (q,) m, m/s
    levels: IntArray  # (q,) largest
    reading: IntArray  # (q,) in the errors
    lowest: FloatArray  # (q,) error that the sensor may show; -inf without a limit
    partner: IntArray  # (q,) a later slot of the same vehicle, or -1
    low_mps2: float  # limits of the commands
    high_mps2: float
    gap_m: float
    target: int  # from 0


def platoon_of(config: FdiConfig, task: Task) -> Platoon:
    """The platoon of a configuration and a task on front sensors."""
    n, model = config.num_vehicles, config.model
    reading = np.flatnonzero(task.sensors.flags(n))
    resolution = np.where(reading < n, config.range_resolution_m, config.rate_resolution_mps)
    bounded = (reading < n) & config.limit_readings
    limited = config.limit_commands
    return Platoon(
        feedback=model.feedback,
        transition=model.transition,
        effect=np.ascontiguousarray((model.injection[:, reading] * resolution).T),
        command=model.readings[reading % n, reading] * resolution,
        resolution=resolution,
        levels=np.where(reading < n, config.range_levels, config.rate_levels),
        reading=reading,
        lowest=np.where(bounded, -config.desired_gap_m - TOLERANCE, -math.inf),
        partner=np.array([_partner(reading % n, slot) for slot in range(len(reading))]),
        low_mps2=config.min_acceleration_mps2 - TOLERANCE if limited else -math.inf,
        high_mps2=config.max_acceleration_mps2 + TOLERANCE if limited else math.inf,
        gap_m=config.desired_gap_m,
        target=task.target - 1,
    )


def anneal(config: FdiConfig, task: Task, start: IntArray | None, plans: int, seed: int = 0) -> IntArray | None:
    """Levels (m, q) at least as fast as `start`, after so many plans; the same for the same seed.

    Without a start the search begins with no injection at all. None where no attack is found.
    """
    platoon, steps = platoon_of(config, task), config.horizon
    shape, generator = (steps, task.sensors.count), np.random.default_rng(seed)
    best: IntArray = np.zeros(shape, np.int64) if start is None else start.astype(np.int64)
    best_mps = _speed(config, task, best)
    for number, done in enumerate(range(0, plans, ROUND)):
        count = min(ROUND, plans - done)
        changes = _changes(shape, count, generator)
        cooling = HOTTEST_MPS * (COLDEST_MPS / HOTTEST_MPS) ** np.linspace(0, 1, count)
        found = np.zeros_like(best) if number % 2 else best.copy()
        follows = generator.random(count) < 0.5
        length = _anneal(platoon, found, *changes, follows, cooling * generator.exponential(size=count))
        if length:  # the collision comes at the end: waiting goes first
            found = np.concatenate([np.zeros_like(found[length:]), found[:length]])
        speed_mps = _speed(config, task, found)
        if speed_mps > best_mps:
            best, best_mps = found, speed_mps
    return best if best_mps > 0 else None


def _partner(vehicle: IntArray, slot: int) -> int:
    later = np.flatnonzero(vehicle[slot + 1 :] == vehicle[slot])
    return slot + 1 + int(later[0]) if len(later) else -1


def _speed(config: FdiConfig, task: Task, levels: IntArray) -> float:
    try:
        return replay(config, task, levels)
    except NoReplayError:
        return -1.0


def _changes(shape: tuple[int, int], count: int, generator: np.random.Generator) -> tuple[IntArray, IntArray, IntArray]:
    """Steps, slots and differences (count, PLACES) of changes; some differences are 0, and steps lie close together."""
    steps, slots = shape
    spread = generator.geometric(0.3, (count, PLACES)) * generator.choice([-1, 1], (count, PLACES))
    spread[:, 0] = 0
    places = np.clip(generator.integers(steps, size=(count, 1)) + spread, 0, steps - 1)
    size = generator.geometric(0.5, (count, PLACES)) * generator.choice([-1, 1], (count, PLACES))
    used = np.arange(PLACES) <= generator.integers(PLACES, size=(count, 1))
    return places, generator.integers(slots, size=(count, PLACES)), np.where(used, size, 0)


@kernel
def _anneal(
    p: Platoon,
    best: IntArray,
    places: IntArray,
    slots: IntArray,
    differences: IntArray,
    follows: BoolArray,
    heat: FloatArray,
) -> int:
    """Improve the plan `best` (m, q) in place; returns the number of injections up to its collision, or 0.

    `follows` (count,) says that later levels keep their distance from the limits instead of their size; `heat`
    (count,) is by how much each change may make the plan worse.
    """
    steps, width = best.shape[0], p.transition.shape[0]
    path, trial = np.zeros((steps + 1, width + 1)), np.zeros((steps + 1, width + 1))
    edges, shifted = np.zeros((*best.shape, 2), np.int64), np.zeros((*best.shape, 2), np.int64)
    plan = best.copy()
    cost, ended, valid = _play(p, plan, plan, edges, path, edges, 0, False)
    best_cost, best_ended, other = cost if valid else 0.0, ended if valid else 0, plan.copy()
    if valid:
        best[:] = plan
    for change in range(places.shape[0]):
        first = steps
        for place in range(places.shape[1]):
            if differences[change, place] != 0:
                first = min(first, places[change, place])
        if first >= ended:
            continue
        other[:] = plan
        for place in range(places.shape[1]):
            other[places[change, place], slots[change, place]] += differences[change, place]
        trial[first] = path[first]
        found, end, valid = _play(p, other, plan, edges, trial, shifted, first, follows[change])
        if found <= cost + heat[change]:
            trial[:first], shifted[:first] = path[:first], edges[:first]
            plan, other, path, trial, edges, shifted = other, plan, trial, path, shifted, edges
            cost, ended = found, end
            if valid and cost < best_cost:
                best_cost, best_ended = cost, ended
                best[:] = plan
    return best_ended


@inlined
def _play(
    p: Platoon,
    plan: IntArray,
    before: IntArray,
    edges: IntArray,
    path: FloatArray,
    shifted: IntArray,
    first: int,
    follows: bool,
) -> tuple[float, int, bool]:
    """Play a plan (m, q) from a step on and make it legal; returns its cost, its length, and whether it is an attack.

    `path` (m + 1, 2n + 1) are errors and the excess so far, known up to `first`; `edges` (m, q, 2) are the lowest and
    highest legal levels of the plan `before`, `shifted` will be those of this one. The cost is minus the impact speed
    and penalties.
    """
    n, width = p.feedback.shape[0], p.transition.shape[0]
    for k in range(first, plan.shape[0] + 1):
        row = path[k]
        left_m, cost = max(row[p.target] + p.gap_m, 0.0), row[n + p.target] + EXCESS * row[width]
        if k > 0 and left_m <= TOLERANCE:
            return cost, k, row[width] == 0 and cost < 0
        early = False
        for i in range(n):
            early |= k > 0 and row[i] + p.gap_m <= SLACK + ROUNDING
        if early or k == plan.shape[0]:
            return cost + MISSED * left_m + (10.0 if early else 0.0), k, False
        path[k + 1, width] = row[width] + _choose(
            p, row, plan[k], before[k], edges[k], shifted[k], follows and k > first
        )
        _move(p, row, plan[k], path[k + 1])
    return math.inf, 0, False


@inlined
def _choose(
    p: Platoon, error: FloatArray, levels: IntArray, before: IntArray, edges: IntArray, shifted: IntArray, follows: bool
) -> float:
    """Move the levels (q,) to the nearest legal ones; returns by how much commands exceed their limits, m/s2."""
    n, width, excess = p.feedback.shape[0], p.transition.shape[0], 0.0
    for i in range(n):
        command = 0.0
        for state in range(width):
            command += p.feedback[i, state] * error[state]
        for slot in range(levels.size):
            if p.reading[slot] % n == i:
                low, high = _legal(p, error, slot, command)
                if follows and p.partner[slot] < 0:
                    side = 1 if edges[slot, 1] - before[slot] <= before[slot] - edges[slot, 0] else 0
                    levels[slot] += (high if side == 1 else low) - edges[slot, side]
                levels[slot] = min(max(levels[slot], low), high)
                shifted[slot, 0], shifted[slot, 1] = low, high
                command += p.command[slot] * levels[slot]
        excess += max(0.0, p.low_mps2 - command, command - p.high_mps2)
    return excess


@inlined
def _legal(p: Platoon, error: FloatArray, slot: int, command: float) -> tuple[int, int]:
    """The lowest and the highest level at which a vehicle's command is legal, if a later slot helps."""
    low, high, effect, help_mps2 = -float(p.levels[slot]), float(p.levels[slot]), p.command[slot], 0.0
    if p.partner[slot] >= 0:
        help_mps2 = p.command[p.partner[slot]] * p.levels[p.partner[slot]]
    if effect > 0:
        low = max(low, math.ceil((p.low_mps2 - help_mps2 - command) / effect))
        high = min(high, math.floor((p.high_mps2 + help_mps2 - command) / effect))
    low = max(low, math.ceil((p.lowest[slot] - error[p.reading[slot]]) / p.resolution[slot]))
    return int(low), int(high)


@inlined
def _move(p: Platoon, error: FloatArray, levels: IntArray, after: FloatArray) -> None:
    """The next errors: A e + B d."""
    for row in range(p.transition.shape[0]):
        total = 0.0
        for state in range(p.transition.shape[0]):
            total += p.transition[row, state] * error[state]
        for slot in range(levels.size):
            total += p.effect[slot, row] * levels[slot]
        after[row] = total
