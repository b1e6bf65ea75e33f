"""One episode as kernels see it: views of its memory, its constants as plain numbers, the shared matrices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import FdiConfig

STEP, TASK, INJECTED_STEPS, REPLACED_STEPS, FALSE_STEPS = range(5)  # columns of the counts (B, NUM_COUNTS)
NUM_COUNTS = 5


class Memory(NamedTuple):
    """What an episode remembers; error coordinates, ranges (m) of vehicles 1..n, then range-rates (m/s).

    All but `error` and `law` describes the last step; `used` is what the commands were computed from.
    """

    error: FloatArray  # (2n,) true e
    injection: FloatArray  # (2n,) d
    reading: FloatArray  # (2n,) e + d
    prediction: FloatArray  # (2n,) of the true values by the model, from readings that the defender trusted
    used: FloatArray  # (2n,) the readings, or what replaced them
    trust: FloatArray  # (2n,) 1, or 0 where the reading was replaced
    command: FloatArray  # (n,) applied, m/s2
    correction: FloatArray  # (n,) the defender's part of it, m/s2
    rear: FloatArray  # (n,) true range errors, which the rear sensors of the vehicles ahead saw
    residual: FloatArray  # (n,) kinematic residual, m
    law: FloatArray  # (n,) A_2 e of the present error: commands if nobody injects, m/s2


BLOCKS_PER_VEHICLE = 2 * 6 + 5


@inlined
def memory_of(memories: FloatArray, b: int) -> Memory:
    """Views of episode b of the memories (B, 17 n)."""
    row = memories[b]
    n = row.size // BLOCKS_PER_VEHICLE
    return Memory(
        row[0 : 2 * n],
        row[2 * n : 4 * n],
        row[4 * n : 6 * n],
        row[6 * n : 8 * n],
        row[8 * n : 10 * n],
        row[10 * n : 12 * n],
        row[12 * n : 13 * n],
        row[13 * n : 14 * n],
        row[14 * n : 15 * n],
        row[15 * n : 16 * n],
        row[16 * n :],
    )


class Constants(NamedTuple):
    """The numbers of a configuration that the kernels need, in the order of `pack_constants`."""

    dt_s: float
    desired_gap_m: float
    min_acceleration_mps2: float
    max_acceleration_mps2: float
    range_resolution_m: float
    rate_resolution_mps: float
    range_levels: float
    rate_levels: float
    share_levels: float
    correction_levels: float
    correction_step_mps2: float
    alarm_cost_mps2: float
    correction_cost: float
    limit_commands: float  # flags: 0 or 1
    limit_readings: float
    clip: float
    look_ahead: float
    shield: float
    by_share: float
    pay_any: float
    share_rear_range: float


def pack_constants(config: FdiConfig) -> FloatArray:
    """The constants of a configuration as an array, which costs less to hand to a kernel than twenty numbers."""
    return np.array(
        Constants(
            dt_s=config.dt_s,
            desired_gap_m=config.desired_gap_m,
            min_acceleration_mps2=config.min_acceleration_mps2,
            max_acceleration_mps2=config.max_acceleration_mps2,
            range_resolution_m=config.range_resolution_m,
            rate_resolution_mps=config.rate_resolution_mps,
            range_levels=config.range_levels,
            rate_levels=config.rate_levels,
            share_levels=config.share_levels,
            correction_levels=config.correction_levels,
            correction_step_mps2=config.max_correction_mps2 / config.correction_levels,
            alarm_cost_mps2=config.alarm_cost_mps2,
            correction_cost=config.correction_cost,
            limit_commands=config.limit_commands,
            limit_readings=config.limit_readings,
            clip=config.limits == "clip",
            look_ahead=config.mask == "look_ahead",
            shield=config.shield,
            by_share=config.attack_action == "share",
            pay_any=config.paid_pair == "any",
            share_rear_range=config.share_rear_range,
        ),
        np.float64,
    )


@inlined
def constants_of(packed: FloatArray) -> Constants:
    """The constants as a tuple of numbers."""
    p = packed
    return Constants(
        p[0],
        p[1],
        p[2],
        p[3],
        p[4],
        p[5],
        p[6],
        p[7],
        p[8],
        p[9],
        p[10],
        p[11],
        p[12],
        p[13],
        p[14],
        p[15],
        p[16],
        p[17],
        p[18],
        p[19],
        p[20],
    )


class Matrices(NamedTuple):
    """The sampled platoon, see `model.Model`, transposed: a row for each input, so that loops run over outputs."""

    law: FloatArray  # (4n, n): A_2, B_a
    step: FloatArray  # (5n, 2n): A, B, correction
    hold: FloatArray  # (3n, 2n): A_d, B_d
    ahead: FloatArray  # (4n, n): A_2 A, A_2 B, the commands one step later if nobody injects then


def pack_matrices(config: FdiConfig) -> FloatArray:
    """The transposed matrices below each other (16 n, 2 n), padded with zeros on the right."""
    model, n = config.model, config.num_vehicles
    blocks = [
        np.hstack([model.feedback, model.readings]).T,
        np.hstack([model.transition, model.injection, model.correction]).T,
        np.hstack([model.coast, model.command]).T,
        np.hstack([model.feedback @ model.transition, model.feedback @ model.injection]).T,
    ]
    padded = [np.pad(block, ((0, 0), (0, 2 * n - block.shape[1]))) for block in blocks]
    return np.ascontiguousarray(np.vstack(padded))


@inlined
def matrices_of(packed: FloatArray) -> Matrices:
    """The blocks of the packed matrices, still padded."""
    n = packed.shape[1] // 2
    return Matrices(packed[: 4 * n], packed[4 * n : 9 * n], packed[9 * n : 12 * n], packed[12 * n :])


@inlined
def add_product(matrix: FloatArray, start: int, vector: FloatArray, total: FloatArray) -> None:
    """Add a block of a system's matrix times a vector (k,) to `total`; its rows (transposed) begin at `start`."""
    for j in range(vector.size):
        value = vector[j]
        if value != 0:
            for i in range(total.size):
                total[i] += matrix[start + j, i] * value


@inlined
def update_law(m: Memory, matrices: Matrices) -> None:
    """Fill `law` of the present error."""
    fill(m.law, 0.0)
    add_product(matrices.law, 0, m.error, m.law)


@inlined
def fill(target: FloatArray, value: float) -> None:
    """Set every entry of an array (k,)."""
    for i in range(target.size):
        target[i] = value


@inlined
def assign(target: FloatArray, values: FloatArray) -> None:
    """Copy an array (k,) to another; unlike `target[:] = values` without tests for shapes and overlap."""
    for i in range(target.size):
        target[i] = values[i]
