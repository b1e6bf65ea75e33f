"""Lifted matrices (3.46) to (3.51): everything that happens up to step m as a linear function of all injections.

The variables of the integer programs are levels, except where one vehicle has both its sensors attacked.

A vehicle's commands take both injections as one number, k_p d_x + k_d d_v. Where that is always g (p z_x + q z_v) with
a unit g and whole p and q without a common divisor, the motion of the platoon depends on w = p z_x + q z_v alone. With
a p + b q = 1, z_x = q s + a w and z_v = b w - p s, whole (s, w) and whole (z_x, z_v) belong to each other one to one,
and s decides only whether the spoofed range is legal. A program over (s, w) says the same and is solved much faster.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import sparse

from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.sensors import Sensors

STRICT_GAP_M = 1e-6
NEGLIGIBLE = 1e-11  # coefficients below are dropped from programs


class Lifted(NamedTuple):
    """Responses to the stacked integer actions z = [z(0); ...; z(m-1)] (m q,), where d(k) = resolution * z(k).

    With the initial error e(0) the platoon is at e(k) = drift[k] e(0) + errors[k] z. Shared and read only; those of a
    shorter horizon are leading parts of these.
    """

    errors: FloatArray  # E (m + 1, 2n, m q), m and m/s
    commands: FloatArray  # U (m, n, m q), m/s2
    readings: FloatArray  # Y (m, q, m q), spoofed readings as errors, m and m/s
    drift: FloatArray  # A^k (m + 1, 2n, 2n)
    drift_commands: FloatArray  # A_2 A^k (m, n, 2n)
    drift_readings: FloatArray  # k_3 A^k (m, q, 2n)
    resolution: FloatArray  # (q,) m and m/s
    levels: IntArray  # (q,) largest |z|, (3.48)


class Rows(NamedTuple):
    """Linear rows lower <= matrix z + drift e(0) <= upper."""

    matrix: sparse.csr_matrix  # (rows, columns)
    lower: FloatArray
    upper: FloatArray
    drift: FloatArray  # (rows, 2n)


@lru_cache(maxsize=256)
def lift(config: FdiConfig, sensors: Sensors) -> Lifted:
    """The lifted matrices over the horizon of the configuration, by stacking; Appendix B.

    Columns are step-major; within a step the attacked ranges by vehicle come first, then the attacked range-rates.
    """
    n, steps, attacked = config.num_vehicles, config.horizon, sensors.flags(config.num_vehicles)
    resolution = np.repeat([config.range_resolution_m, config.rate_resolution_mps], n)[attacked]
    model = config.model
    q, inputs, direct = len(resolution), model.injection[:, attacked], model.readings[:, attacked]
    errors = np.zeros((steps + 1, 2 * n, steps * q))
    drift = np.stack([np.eye(2 * n)] * (steps + 1))
    for k in range(steps):
        errors[k + 1] = model.transition @ errors[k]
        errors[k + 1][:, k * q : (k + 1) * q] += inputs * resolution
        drift[k + 1] = model.transition @ drift[k]
    commands, readings = model.feedback @ errors[:-1], errors[:-1, attacked].copy()
    for k in range(steps):
        commands[k][:, k * q : (k + 1) * q] += direct * resolution
        readings[k][:, k * q : (k + 1) * q] += np.diag(resolution)
    levels = np.repeat([config.range_levels, config.rate_levels], n)[attacked]
    lifted = Lifted(
        errors, commands, readings, drift, model.feedback @ drift[:-1], drift[:-1, attacked], resolution, levels
    )
    for array in lifted:
        array.setflags(write=False)
    return lifted


def legal_rows(config: FdiConfig, sensors: Sensors, steps: int, *, strict: bool = False) -> Rows:
    """What makes `steps` injections legal: (3.49) and (3.50) at k = 0..steps-1, and no collision at k = 1..steps-1.

    The bounds (3.48) are those of the columns. Limits are widened by the environments' tolerance, and gaps may touch a
    collision; strict rows have neither: gaps stay `STRICT_GAP_M` away, (3.51).
    """
    n, lifted, columns = config.num_vehicles, lift(config, sensors), steps * sensors.count
    slack, gap_margin_m = (0.0, STRICT_GAP_M) if strict else (SLACK, 0.0)
    blocks = [(lifted.errors[1:steps, :n], lifted.drift[1:steps, :n], gap_margin_m - config.desired_gap_m, np.inf)]
    if config.limit_commands:
        low, high = config.min_acceleration_mps2 - slack, config.max_acceleration_mps2 + slack
        blocks.append((lifted.commands[:steps], lifted.drift_commands[:steps], low, high))
    if config.limit_readings:  # a range of 0 m or more; range-rates are unlimited
        ranges = slice(len(sensors.range))
        low = -config.desired_gap_m - slack
        blocks.append((lifted.readings[:steps, ranges], lifted.drift_readings[:steps, ranges], low, np.inf))
    return stack([rows(block[..., :columns], drift, low, high) for block, drift, low, high in blocks])


def end_rows(config: FdiConfig, sensors: Sensors, steps: int, row: int, lower: float, upper: float) -> Rows:
    """Limits of one entry of e(steps); `row` counts gap errors first, then relative speeds."""
    lifted = lift(config, sensors)
    end = lifted.errors[steps, row : row + 1, : steps * sensors.count]
    return rows(end, lifted.drift[steps, row : row + 1], lower, upper)


def rows(matrix: FloatArray, drift: FloatArray, lower: float, upper: float) -> Rows:
    """Rows of a response (..., columns) and its drift (..., 2n) with the same limits for all."""
    flat = matrix.reshape(-1, matrix.shape[-1])
    kept = sparse.csr_matrix(np.where(np.abs(flat) < NEGLIGIBLE, 0.0, flat))
    return Rows(kept, np.full(len(flat), lower), np.full(len(flat), upper), drift.reshape(-1, drift.shape[-1]))


def through(limits: Rows, transform: sparse.csr_matrix) -> Rows:
    """The same limits of y, where z = transform @ y."""
    matrix = sparse.csr_matrix(limits.matrix @ transform)
    matrix.data[np.abs(matrix.data) < NEGLIGIBLE] = 0.0
    matrix.eliminate_zeros()
    return limits._replace(matrix=matrix)


def violation(limits: Rows, z: FloatArray | IntArray) -> float:
    """By how much the actions (columns,) exceed the worst of the limits, from rest."""
    value = limits.matrix @ z
    return float(np.maximum(limits.lower - value, value - limits.upper).max(initial=0.0))


def stack(parts: list[Rows]) -> Rows:
    """All rows of the parts, in their order."""
    matrices, lowers, uppers, drifts = zip(*parts, strict=True)
    return Rows(sparse.vstack(matrices, "csr"), *map(np.concatenate, (lowers, uppers, drifts)))


LARGEST_DENOMINATOR = 1000
SAME = 1e-12  # largest relative difference of two ratios that count as equal


class LiftedColumns(NamedTuple):
    """Whole variables y (m q,) of a program; levels are z = transform @ y, variables inverse @ z, both whole."""

    transform: sparse.csr_matrix  # (m q, m q)
    inverse: sparse.csr_matrix
    bound: FloatArray  # (m q,) |y| <= bound
    rows: Rows  # (3.48) of the levels that are no variables


@lru_cache(maxsize=256)
def columns_of(config: FdiConfig, sensors: Sensors) -> LiftedColumns:
    """The variables of all injections up to the horizon; (s, w) have the places of (z_x, z_v)."""
    levels, steps = lift(config, sensors).levels.astype(np.float64), config.horizon
    ratio = joint_ratio(config)
    q = sensors.count
    transform, inverse = np.eye(q), np.eye(q)  # of one step
    for vehicle in sensors.range:
        if ratio is not None and vehicle in sensors.range_rate:
            places = np.ix_(
                *2 * [[sensors.range.index(vehicle), len(sensors.range) + sensors.range_rate.index(vehicle)]]
            )
            transform[places], inverse[places] = _joint(ratio)
    replaced = np.flatnonzero(np.tile((transform != np.eye(q)).any(axis=1), steps))
    transforms, inverses = (sparse.kron(sparse.eye(steps), step, "csr") for step in (transform, inverse))
    limits = np.tile(levels, steps)[replaced]
    rows = Rows(transforms[replaced], -limits, limits, np.zeros((len(replaced), 2 * config.num_vehicles)))
    return LiftedColumns(transforms, inverses, np.tile(np.abs(inverse) @ levels, steps), rows)


def joint_ratio(config: FdiConfig) -> Fraction | None:
    """The ratio p / q = k_p res_x / (k_d res_v) in lowest terms; None where it is no ratio of small whole numbers."""
    rate = config.derivative_gain * config.rate_resolution_mps
    if rate == 0 or config.proportional_gain == 0:
        return None
    ratio = config.proportional_gain * config.range_resolution_m / rate
    fraction = Fraction(ratio).limit_denominator(LARGEST_DENOMINATOR)
    return fraction if fraction > 0 and abs(float(fraction) - ratio) <= SAME * ratio else None


def _joint(ratio: Fraction) -> tuple[FloatArray, FloatArray]:
    """From (s, w) to (z_x, z_v), and back; both (2, 2) and whole."""
    p, q = ratio.numerator, ratio.denominator
    a = (pow(p, -1, q) + q // 2) % q - q // 2
    b = (1 - a * p) // q
    return np.array([[q, a], [-p, b]], np.float64), np.array([[b, -a], [p, q]], np.float64)
