"""Both roles' observations, in the order of `fields.py`."""

from __future__ import annotations

import numpy as np

from cps_envs.core.fields import encode_row
from cps_envs.core.kernels import borrowed, inlined, kernel
from cps_envs.core.types import FloatArray, IntArray, Observation
from cps_envs.fdi.memory import STEP, TASK, Constants, Memory, constants_of, memory_of


@kernel
def observe_attacker(
    memories: FloatArray,
    counts: IntArray,
    horizon: int,
    drawn: bool,
    packed: FloatArray,
    tasks: IntArray,
    scale: FloatArray,
    observations: Observation,
) -> None:
    """Fill (B, size) with `fields.attacker_fields`, encoded by their `scale`; the other arguments as in `turn`."""
    c, values = constants_of(packed), np.empty(observations.shape[1])
    for b in range(observations.shape[0]):
        memory, task = memory_of(borrowed(memories), b), borrowed(tasks)[counts[b, TASK]]
        fill_attacker(memory, c, task, horizon - counts[b, STEP], drawn, values)
        encode_row(values, borrowed(scale), borrowed(observations)[b])


@inlined
def fill_attacker(
    memory: Memory, c: Constants, task: IntArray, steps_left: int, drawn: bool, values: FloatArray
) -> None:
    """The values (size,) of one episode in the units of the fields."""
    n, slots = memory.law.size, task.size - 1
    for j in range(2 * n):
        values[j] = memory.error[j]
    for i in range(n):
        values[2 * n + i] = memory.law[i]
    at = 3 * n
    for s in range(slots):
        sensor = task[s]
        values[at + s] = 0.0
        if sensor >= 0:
            ranges = sensor < n
            largest = c.range_levels * c.range_resolution_m if ranges else c.rate_levels * c.rate_resolution_mps
            values[at + s] = memory.injection[sensor] / largest
    at += slots
    values[at] = steps_left
    if drawn:
        for j in range(2 * n):
            values[at + 1 + j] = 1.0 if task[j] >= 0 else 0.0
        for i in range(n):
            values[at + 1 + 2 * n + i] = 1.0 if task[slots] == i else 0.0


@kernel
def observe_defender(
    memories: FloatArray,
    counts: IntArray,
    horizon: int,
    packed: FloatArray,
    scale: FloatArray,
    observations: Observation,
) -> None:
    """Fill (B, size) with `fields.defender_fields`, encoded by their `scale`; the other arguments as in `turn`."""
    c, values = constants_of(packed), np.empty(observations.shape[1])
    for b in range(observations.shape[0]):
        fill_defender(memory_of(borrowed(memories), b), c, horizon - counts[b, STEP], values)
        encode_row(values, borrowed(scale), borrowed(observations)[b])


@inlined
def fill_defender(memory: Memory, c: Constants, steps_left: int, values: FloatArray) -> None:
    """The values (size,) of one episode in the units of the fields."""
    n = memory.law.size
    for j in range(2 * n):
        values[j] = memory.reading[j]
        values[2 * n + j] = memory.reading[j] - memory.prediction[j]
    for i in range(n):
        values[4 * n + i] = memory.residual[i]
    at = 5 * n
    if c.share_rear_range > 0:
        for i in range(n - 1):
            values[at + i] = memory.reading[i] - memory.rear[i]
        at += n - 1
    for i in range(n):
        values[at + i] = memory.command[i]
    at += n
    for j in range(2 * n):
        values[at + j] = memory.trust[j]
    values[at + 2 * n] = steps_left
