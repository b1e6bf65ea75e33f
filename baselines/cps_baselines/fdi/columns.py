"""The variables of the integer programs: levels, except where one vehicle has both its sensors attacked.

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

from cps_baselines.fdi.lifted import Rows, lift
from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.sensors import Sensors

LARGEST_DENOMINATOR = 1000
SAME = 1e-12  # largest relative difference of two ratios that count as equal


class Columns(NamedTuple):
    """Whole variables y (m q,) of a program; levels are z = transform @ y, variables inverse @ z, both whole."""

    transform: sparse.csr_matrix  # (m q, m q)
    inverse: sparse.csr_matrix
    bound: FloatArray  # (m q,) |y| <= bound
    rows: Rows  # (3.48) of the levels that are no variables


@lru_cache(maxsize=256)
def columns_of(config: FdiConfig, sensors: Sensors) -> Columns:
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
    return Columns(transforms, inverses, np.tile(np.abs(inverse) @ levels, steps), rows)


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
