"""A defender that compares readings with the model's prediction; an extension beyond the paper."""

from __future__ import annotations

import numpy as np

from baselines.fdi.detector import ROUNDING, Detector, Seen
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import Array, BoolArray, FloatArray

DEVIATIONS = 5.0  # chosen: one reading in two million is beyond


class ModelFallback(Detector):
    """Doubts a reading that lies more than `deviations` standard deviations off the model's prediction.

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
        variance = sources * config.disturbance_mps2**2
        self._growth: FloatArray = variance[:, np.newaxis] * np.array([dt_s**4 / 4, dt_s**3 / 2, dt_s**2])
        self._known = (np.arange(n) < n - 1) & config.share_rear_range  # pairs whose range is measured twice

    def blank(self, envs: int) -> FloatArray:
        """Covariances (B, n, 3) of gap error and relative speed: xx, xv, vv; the start is known exactly."""
        return np.zeros((envs, self.config.num_vehicles, 3))

    def distrust(self, seen: Seen, memory: Array) -> tuple[BoolArray, Array]:
        """See the class."""
        innovation = np.concatenate([seen["range_innovation"], seen["rate_innovation"]], axis=1)
        deviation = np.sqrt(np.concatenate([memory[..., 0], memory[..., 2]], axis=1))
        distrusted = np.abs(innovation) > self.deviations * deviation + ROUNDING
        return distrusted, self._predicted(memory, ~distrusted)

    def _predicted(self, covariance: FloatArray, trusted: BoolArray) -> FloatArray:
        """The covariances (B, n, 3) one step after the trusted readings (B, 2n) were used."""
        ranges, rates = np.split(trusted, 2, axis=1)
        certain = ranges | self._known
        xx = np.where(certain, 0.0, covariance[..., 0])
        vv = np.where(rates, 0.0, covariance[..., 2])
        xv = np.where(certain | rates, 0.0, covariance[..., 1])
        dt_s = self.config.dt_s
        return np.stack([xx + 2 * dt_s * xv + dt_s**2 * vv, xv + dt_s * vv, vv], axis=2) + self._growth
