"""The values of both roles' observations, in the order of `fields.py`."""

from __future__ import annotations

from cps_envs.core.compiled import borrowed, kernel
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.lane import BLOCKS_PER_VEHICLE, STEP, TASK, constants_of, memory_of


@kernel
def observe_attacker(
    memories: FloatArray,
    counts: IntArray,
    horizon: int,
    drawn: bool,
    packed: FloatArray,
    tasks: IntArray,
    values: FloatArray,
) -> None:
    """Fill (B, size) with `fields.attacker_fields`; the other arguments as for `turn.take_turn`."""
    c, slots, n = constants_of(packed), tasks.shape[1] - 1, memories.shape[1] // BLOCKS_PER_VEHICLE
    for b in range(values.shape[0]):
        memory, row, sensors = memory_of(borrowed(memories), b), borrowed(values)[b], borrowed(tasks)[counts[b, TASK]]
        for j in range(2 * n):
            row[j] = memory.error[j]
        for i in range(n):
            row[2 * n + i] = memory.law[i]
        at = 3 * n
        for s in range(slots):
            sensor = sensors[s]
            row[at + s] = 0.0
            if sensor >= 0:
                ranges = sensor < n
                largest = c.range_levels * c.range_resolution_m if ranges else c.rate_levels * c.rate_resolution_mps
                row[at + s] = memory.injection[sensor] / largest
        at += slots
        row[at] = horizon - counts[b, STEP]
        if drawn:
            for j in range(2 * n):
                row[at + 1 + j] = 1.0 if sensors[j] >= 0 else 0.0
            for i in range(n):
                row[at + 1 + 2 * n + i] = 1.0 if sensors[slots] == i else 0.0


@kernel
def observe_defender(
    memories: FloatArray, counts: IntArray, horizon: int, packed: FloatArray, values: FloatArray
) -> None:
    """Fill (B, size) with `fields.defender_fields`; the other arguments as for `turn.take_turn`."""
    c, n = constants_of(packed), memories.shape[1] // BLOCKS_PER_VEHICLE
    for b in range(values.shape[0]):
        memory, row = memory_of(borrowed(memories), b), borrowed(values)[b]
        for j in range(2 * n):
            row[j] = memory.reading[j]
            row[2 * n + j] = memory.reading[j] - memory.prediction[j]
        for i in range(n):
            row[4 * n + i] = memory.residual[i]
        at = 5 * n
        if c.share_rear_range > 0:
            for i in range(n - 1):
                row[at + i] = memory.reading[i] - memory.rear[i]
            at += n - 1
        for i in range(n):
            row[at + i] = memory.command[i]
        at += n
        for j in range(2 * n):
            row[at + j] = memory.trust[j]
        row[at + 2 * n] = horizon - counts[b, STEP]
