"""Injections played step by step in double precision, with the tolerances of the environments."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.task import Task

ROUNDING = 1e-9  # kept from every threshold, so that another order of summation decides alike


class NoReplayError(ValueError):
    """Injections that are not legal, or that do not end in the wanted collision."""


def replay(config: FdiConfig, task: Task, injections: IntArray, start: FloatArray | None = None) -> float:
    """The impact speed (m/s, 0 or more) of levels (k, q), sensors in the order ranges, then range-rates.

    The k-th injection leads to the collision, and nobody collides before; k is at most the horizon. From rest waiting
    first is free, so with k below the horizon the same speed is reached at the horizon. `start` (2n,) is another e(0).

    Raises:
        NoReplayError: a limit of (3.48) to (3.50) is exceeded, a pair collides early, or the target not at the end.
    """
    levels = np.asarray(injections)
    model, n, attacked = config.model, config.num_vehicles, task.sensors.flags(config.num_vehicles)
    if not 0 < len(levels) <= config.horizon:
        raise NoReplayError(f"{len(levels)} injections do not fit a horizon of {config.horizon} steps")
    error: FloatArray = np.zeros(2 * n) if start is None else start
    for step, level in enumerate(levels):
        if step and np.any(error[:n] <= SLACK + ROUNDING - config.desired_gap_m):
            raise NoReplayError(f"a pair collides at step {step} of {len(levels)}")
        injection = np.zeros(2 * n)
        injection[attacked] = level * np.repeat([config.range_resolution_m, config.rate_resolution_mps], n)[attacked]
        _check_legal(config, task, error, injection, level, step)
        error = model.transition @ error + model.injection @ injection
    if error[task.target - 1] > SLACK - ROUNDING - config.desired_gap_m:
        raise NoReplayError(f"the target does not collide: its gap is {error[task.target - 1]:+.6f} m off at the end")
    return max(0.0, -float(error[n + task.target - 1]))


def _check_legal(
    config: FdiConfig, task: Task, error: FloatArray, injection: FloatArray, level: IntArray, step: int
) -> None:
    n, slack = config.num_vehicles, SLACK - ROUNDING
    most = np.repeat([config.range_levels, config.rate_levels], n)[task.sensors.flags(n)]
    if np.any(np.abs(level) > most):
        raise NoReplayError(f"step {step}: an injection exceeds the largest one")
    command = config.model.feedback @ error + config.model.readings @ injection
    low, high = config.min_acceleration_mps2 - slack, config.max_acceleration_mps2 + slack
    if config.limit_commands and not np.all((low <= command) & (command <= high)):
        raise NoReplayError(f"step {step}: a commanded acceleration of {command.min():.4f} to {command.max():.4f} m/s2")
    spoofed = (error + injection)[:n][task.sensors.flags(n)[:n]]
    if config.limit_readings and np.any(spoofed < -config.desired_gap_m - slack):
        raise NoReplayError(f"step {step}: a spoofed range below 0 m")
