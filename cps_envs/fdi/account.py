"""The account of a step: times, collisions, what the defender is charged, the payoff."""

from __future__ import annotations

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.memory import FALSE_STEPS, INJECTED_STEPS, REPLACED_STEPS, STEP, Constants, Memory
from cps_envs.fdi.metrics import (
    ALARM_COST,
    BOUND_VALID,
    COLLIDED_PAIRS,
    COLLIDED_TARGET,
    CORRECTION_COST,
    FALSE_ALARMS,
    IMPACT,
    INJECTED,
    PAYOFF,
    REPLACED,
    TIME,
    WORST_IMPACT,
)


@inlined
def settle(memory: Memory, c: Constants, target: int, correction: FloatArray, count: IntArray, row: FloatArray) -> bool:
    """Book a step that has been made; returns whether it ended in a collision."""
    row[TIME] = count[STEP] * c.dt_s
    paid = row[IMPACT] + row[ALARM_COST] + row[CORRECTION_COST]
    charge(memory, c, correction, count, row)
    collided = collide(memory.error, c, target, row)
    row[PAYOFF] += row[IMPACT] + row[ALARM_COST] + row[CORRECTION_COST] - paid
    return collided


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
