"""A turn of the marked lanes: both roles' actions, one step, the end of the episode, the account."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compiled import inlined, kernel
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.choice import choose_levels
from cps_envs.fdi.dynamics import command, correct, move, predict, sense, within_limits
from cps_envs.fdi.lane import (
    FALSE_STEPS,
    INJECTED_STEPS,
    NUM_COUNTS,
    REPLACED_STEPS,
    STEP,
    TASK,
    Constants,
    Memory,
    constants_of,
    load,
    matrices_of,
    memory_of,
    store,
    update_law,
)
from cps_envs.fdi.legality import SLACK, legal_levels, resolution
from cps_envs.fdi.metrics import (
    ALARM_COST,
    BOUND_VALID,
    COLLIDED_PAIRS,
    COLLIDED_TARGET,
    CORRECTION_COST,
    FALSE_ALARMS,
    ILLEGAL,
    IMPACT,
    INJECTED,
    PAYOFF,
    REPLACED,
    TIME,
    WORST_IMPACT,
)


@kernel
def take_turn(
    memories: FloatArray,
    counts: IntArray,
    table: FloatArray,
    legal: IntArray,
    attack: IntArray,
    defense: IntArray,
    lanes: BoolArray,
    over: BoolArray,
    num_steps: int,
    disturbances: FloatArray,
    packed: FloatArray,
    stacked: FloatArray,
    tasks: IntArray,
) -> None:
    """Move the marked lanes by some steps under held actions.

    Args:
        memories: (B, 17 n), see `lane.Memory`.
        counts: (B, NUM_COUNTS), see `lane`.
        table: (B, metrics + 1), see `metrics`; the last column is filled with the payoff of this turn.
        legal: (B, S, 2), filled with the legal levels of the next turn.
        attack: (B, S) actions.
        defense: (B, 3 n) trust of the readings and correction levels, or (B, 0).
        lanes: (B,) the lanes to move.
        over: (B,) lanes that have ended stand still; filled with those that end now.
        num_steps: how many.
        disturbances: (B, horizon, n) accelerations in m/s2, or (B, 0, 0).
        packed: see `lane.pack_constants`.
        stacked: see `lane.pack_matrices`.
        tasks: (T, S + 1) sensors of each slot, -1 where not attacked, and the target's index.
    """
    c, m = constants_of(packed), matrices_of(stacked)
    n, slots = stacked.shape[1] // 2, tasks.shape[1] - 1
    trust, correction, offset, scratch = np.ones(2 * n), np.zeros(n), np.empty(2 * n), np.empty(2 * n)
    level, coefficients, calm = np.empty(slots, np.int64), np.empty(slots), np.empty(0)
    # A lane is worked on in these copies: views made for each lane would cost more than its step.
    cell, row, count = np.empty((1, memories.shape[1])), np.empty(table.shape[1]), np.empty(NUM_COUNTS, np.int64)
    action, answer, interval = (
        np.empty(slots, np.int64),
        np.empty(defense.shape[1], np.int64),
        np.empty((slots, 2), np.int64),
    )
    task, memory = np.empty(slots + 1, np.int64), memory_of(cell, 0)
    sensors, defended = task[:slots], defense.shape[1] > 0
    for b in range(lanes.size):
        table[b, PAYOFF] = 0.0
        if not lanes[b] or over[b]:
            continue
        load(memories, b, cell[0])
        load(table, b, row)
        load(counts, b, count)
        load(attack, b, action)
        load(defense, b, answer)
        load(tasks, count[TASK], task)
        for _ in range(num_steps):
            step = count[STEP]
            if defended:  # before this step's commands take the place of the last ones
                read_defense(answer, c, trust, correction)
                predict(memory, c, m, trust, step == 0, scratch)
            choose_levels(action, memory, c, m, sensors, interval, level, coefficients)
            inject(memory.injection, c, sensors, level)
            command(memory, m, memory.injection)
            if c.clip == 0 and not within_limits(memory, c):
                over[b] = True
                row[ILLEGAL] = 1.0
                break
            sense(memory, c, trust, step == 0, offset)
            if defended:
                command(memory, m, offset)
            correct(memory, c, correction)
            move(memory, c, m, offset, disturbances[b, step] if disturbances.shape[1] > 0 else calm, scratch)
            update_law(memory, m)
            count[STEP] = step + 1
            row[TIME] = (step + 1) * c.dt_s
            paid = row[IMPACT] + row[ALARM_COST] + row[CORRECTION_COST]
            charge(memory, c, correction, count, row)
            over[b] = collide(memory.error, c, task[slots], row)
            row[PAYOFF] += row[IMPACT] + row[ALARM_COST] + row[CORRECTION_COST] - paid
            if over[b]:
                break
        if c.by_share == 0 and row[ILLEGAL] == 0:
            legal_levels(memory, c, m, sensors, level, 0, interval, coefficients)
            for s in range(slots):
                legal[b, s, 0], legal[b, s, 1] = interval[s, 0], interval[s, 1]
        store(cell[0], memories, b)
        store(row, table, b)
        store(count, counts, b)


@inlined
def inject(injection: FloatArray, c: Constants, sensors: IntArray, level: IntArray) -> None:
    """The injections (2n,) of all readings, m or m/s, from the levels of the attacked sensors."""
    injection[:] = 0.0
    for s in range(sensors.size):
        if sensors[s] >= 0:
            injection[sensors[s]] = level[s] * resolution(c, sensors[s], injection.size // 2)


@inlined
def read_defense(action: IntArray, c: Constants, trust: FloatArray, correction: FloatArray) -> None:
    """Trust (2n,) and corrections (n,) in m/s2 of a defender's action (3n,)."""
    n = correction.size
    for j in range(2 * n):
        trust[j] = action[j]
    for i in range(n):
        correction[i] = (action[2 * n + i] - c.correction_levels) * c.correction_step_mps2


@inlined
def charge(m: Memory, c: Constants, correction: FloatArray, count: IntArray, row: FloatArray) -> None:
    """Book what the defender did in this step, and how often without reason."""
    n = correction.size
    for j in range(2 * n):
        injected, replaced = m.injection[j] != 0, m.trust[j] == 0
        count[INJECTED_STEPS] += injected
        if replaced:
            count[REPLACED_STEPS] += 1
            count[FALSE_STEPS] += not injected
            row[ALARM_COST] += c.alarm_cost_mps2 * c.dt_s
            row[BOUND_VALID] = 0.0
    for i in range(n):
        if correction[i] != 0:
            row[CORRECTION_COST] += c.correction_cost * c.dt_s * abs(correction[i]) / n
            row[BOUND_VALID] = 0.0
    readings = 2 * n * count[STEP]
    row[INJECTED] = count[INJECTED_STEPS] / readings
    row[REPLACED] = count[REPLACED_STEPS] / readings
    row[FALSE_ALARMS] = count[FALSE_STEPS] / max(readings - count[INJECTED_STEPS], 1)


@inlined
def collide(error: FloatArray, c: Constants, target: int, row: FloatArray) -> bool:
    """Book the collisions at this sample; returns whether there was one."""
    pairs, worst = 0, 0.0
    n = error.size // 2
    for i in range(n):
        if error[i] <= -c.desired_gap_m + SLACK:
            pairs += 1
            worst = max(worst, -error[n + i])
            if i == target:
                row[COLLIDED_TARGET] = 1.0
                row[IMPACT] = max(0.0, -error[n + i])
    row[COLLIDED_PAIRS], row[WORST_IMPACT] = pairs, worst
    if c.pay_any > 0:
        row[IMPACT] = worst
    return pairs > 0


@kernel
def open_lanes(
    memories: FloatArray,
    counts: IntArray,
    legal: IntArray,
    lanes: BoolArray,
    packed: FloatArray,
    stacked: FloatArray,
    tasks: IntArray,
) -> None:
    """Fill what follows from the error and the task of lanes that begin; arguments as for `take_turn`."""
    c, m = constants_of(packed), matrices_of(stacked)
    slots = tasks.shape[1] - 1
    level, coefficients = np.zeros(slots, np.int64), np.empty(slots)
    for b in range(lanes.size):
        if lanes[b]:
            memory = memory_of(memories, b)
            for values in (memory.reading, memory.prediction, memory.used):
                values[:] = memory.error
            memory.rear[:] = memory.error[: memory.rear.size]
            memory.trust[:] = 1.0
            update_law(memory, m)
            legal_levels(memory, c, m, tasks[counts[b, TASK], :slots], level, 0, legal[b], coefficients)
