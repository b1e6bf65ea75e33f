"""A defender that compares readings with the model's prediction; an extension beyond the paper."""

from __future__ import annotations

import math

import numpy as np

from cps_baselines.fdi.detectors import ROUNDING, Detector
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation

DEVIATIONS = 5.0  # chosen: one reading in two million is beyond


@plays_in("paper")
class ModelFallback(Detector):
    """Rejects a reading that is more than `deviations` standard deviations off the model's prediction.

    How far a true reading may be off follows from the disturbance of the configuration, as in a Kalman filter without
    measurement noise: a double integrator whose covariance grows while readings are replaced and falls to zero where
    one is used. So a reading that was doubted is used again as soon as the model cannot rule it out. Attacks of less
    than the gate pass, and the longer a reading is doubted the wider it opens.

    Raises:
        ConfigurationError: not a positive number of deviations.
    """

    def __init__(self, spec: RoleSpec, *, deviations: float = DEVIATIONS) -> None:
        super().__init__(spec)
        if not deviations > 0:
            raise ConfigurationError(f"deviations = {deviations} must be above 0")
        self.deviations = deviations
        config, n, dt_s = self.config, self.config.num_vehicles, self.config.dt_s
        sources = np.where(np.arange(n) < n - 1, 2, 1)  # independent disturbances in a pair; the reference has none
        variance = sources * bounds(config.disturbance_mps2)[1] ** 2
        self._growth: FloatArray = variance[:, np.newaxis] * np.array([dt_s**4 / 4, dt_s**3 / 2, dt_s**2])
        self._known = np.arange(n) < n - 1  # pairs whose range is measured twice

    def blank(self, envs: int) -> FloatArray:
        """Covariances (B, n, 3) of gap error and relative speed: xx, xv, vv; the start is known exactly."""
        return np.zeros((envs, self.config.num_vehicles, 3))

    def judge(self, seen: Seen, memory: Array, actions: IntArray) -> None:
        """See the class."""
        _compare_with_model(
            seen.observation,
            seen.start,
            seen.fields.offsets,
            seen.fields.scale,
            self.deviations,
            self.config.dt_s,
            self._growth,
            self._known,
            memory,
            actions,
        )


@kernel
def _compare_with_model(
    observation: Observation,
    start: BoolArray,
    offsets: Array,
    scale: FloatArray,
    deviations: float,
    dt_s: float,
    growth: FloatArray,
    known: BoolArray,
    memory: FloatArray,
    actions: IntArray,
) -> None:
    """`ModelFallback.judge` on observations (B, size) whose fields begin at `offsets`.

    A covariance `memory[b, i]` (3,) grows by `growth[i]` in a step, in which readings that are trusted become certain;
    the ranges that are `known` (n,) are anyway.
    """
    n, at = memory.shape[1], offsets[0]
    for b in range(memory.shape[0]):
        for i in range(n):
            covariance = memory[b, i]
            xx, xv, vv = (0.0, 0.0, 0.0) if start[b] else (covariance[0], covariance[1], covariance[2])
            range_off = abs(decode_entry(observation[b], scale, at.range_innovation + i))
            rate_off = abs(decode_entry(observation[b], scale, at.rate_innovation + i))
            range_doubted = range_off > deviations * math.sqrt(xx) + ROUNDING
            rate_doubted = rate_off > deviations * math.sqrt(vv) + ROUNDING
            actions[b, i], actions[b, n + i] = not range_doubted, not rate_doubted
            certain = not range_doubted or known[i]
            xx = 0.0 if certain else xx
            xv = 0.0 if certain or not rate_doubted else xv
            vv = vv if rate_doubted else 0.0
            covariance[0] = xx + 2 * dt_s * xv + dt_s**2 * vv + growth[i, 0]
            covariance[1] = xv + dt_s * vv + growth[i, 1]
            covariance[2] = vv + growth[i, 2]
