"""The filter of the environments in matrices, for policies that predict what it will make of readings."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, fill, inlined
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import BoolArray, FloatArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.estimation import state_of, variance_of
from cps_envs.fdi.state import Constants, constants_of, disturbance_covariance


class PlatoonFilter(NamedTuple):
    """e(k+1) = coast e(k) + command u(k) + disturbance; R readings = view e + noise. Shared and read only."""

    coast: FloatArray  # (2n, 2n)
    command: FloatArray  # (2n, n)
    view: FloatArray  # (R, 2n)
    spread: FloatArray  # (2n, 2n) covariance of a step's disturbances
    noise: FloatArray  # (R,) variances of honest readings
    start: FloatArray  # (2n, 2n) covariance of the first prediction


@lru_cache(maxsize=16)
def platoon_filter(config: FdiConfig) -> PlatoonFilter:
    """The matrices of a configuration.

    Raises:
        ConfigurationError: the configuration has no filter.
    """
    if config.estimator != "kalman":
        raise ConfigurationError('this policy needs estimator = "kalman", as in preset "learning"')
    n, readings, model = config.num_vehicles, config.num_readings, config.model
    c = Constants(*constants_of(config)[0])
    spread_of = np.repeat([config.gap_spread_m, config.speed_spread_mps], n)
    found = PlatoonFilter(
        coast=model.coast,
        command=model.command,
        view=np.eye(2 * n)[[state_of(j, n, readings) for j in range(readings)]],
        spread=disturbance_covariance(config),
        noise=np.array([variance_of(j, config.sensor_noise[j], c) for j in range(readings)]),
        start=np.diag(spread_of**2 / 3),
    )
    for matrix in found:
        matrix.setflags(write=False)
    return found


@lru_cache(maxsize=16)
def trusting(config: FdiConfig) -> tuple[FloatArray, FloatArray]:
    """Gains (k, 2n, R) and innovation deviations (k, R) of the filter that trusts all sensors, k = 0..horizon."""
    law = platoon_filter(config)
    gains, deviations = gains_of(law, [np.ones(len(law.view), np.bool_)], config.horizon + 1)
    return gains[:, 0], deviations[:, 0]


@inlined
def hear(
    row: Observation, at: Record, scale: FloatArray, command: FloatArray, told: FloatArray, moved: FloatArray
) -> None:
    """Fill in what the sensors tell now (R,), and what the last commands did (2n,) by `command` (2n, n)."""
    half = told.size // 2
    for j in range(half):
        told[j] = decode_entry(row, scale, at.range_error + j)
        told[half + j] = decode_entry(row, scale, at.range_rate + j)
    fill(moved, 0.0)
    for i in range(command.shape[1]):
        commanded = decode_entry(row, scale, at.command + i)
        for k in range(moved.size):
            moved[k] += command[k, i] * commanded


def gains_of(law: PlatoonFilter, sets: Sequence[BoolArray], steps: int) -> tuple[FloatArray, FloatArray]:
    """Gains (steps, K, 2n, R) and innovation deviations (steps, K, R) of filters that trust K sets of sensors (R,).

    Those of a set's other sensors are zero, and the deviations are what they would have.
    """
    size, trusted = len(law.coast), np.array(sets)
    gains = np.zeros((steps, len(trusted), size, len(law.view)))
    deviations = np.zeros((steps, len(trusted), len(law.view)))
    for place, marks in enumerate(trusted):
        covariance, view = law.start, law.view[marks]
        for k in range(steps):
            seen = law.view @ covariance
            deviations[k, place] = np.sqrt(np.einsum("ij,ij->i", seen, law.view) + law.noise)
            gain = np.linalg.solve(view @ covariance @ view.T + np.diag(law.noise[marks]), view @ covariance).T
            gains[k, place][:, marks] = gain
            after = (np.eye(size) - gain @ view) @ covariance
            covariance = law.coast @ (after + after.T) / 2 @ law.coast.T + law.spread
    return gains, deviations
