"""A defender that compares front and rear sensors, where both are noisy; an extension beyond the paper."""

from __future__ import annotations

import numpy as np

from cps_baselines.fdi.innovation_tests import DRIFT, RELEASE_S, Cusum, Sums
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import BoolArray, FloatArray

PAIR_THRESHOLD = 14.0


class RedundantCusum(Cusum):
    """Plays `cusum`, and also sums the difference of the two sensors that measure the same gap.

    No disturbance hides in a difference, so that small lies stand out in it sooner. It does not tell which of the two
    lies: both are doubted. The lead's gap has one sensor; and liars that agree show no difference.

    The other options are those of `Cusum`.

    Raises:
        ConfigurationError: options out of range, or no filter.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        pair_threshold: float = PAIR_THRESHOLD,
        drift: float = DRIFT,
        release_s: float = RELEASE_S,
        **options: float,
    ) -> None:
        super().__init__(spec, drift=drift, release_s=release_s, **options)
        n, half = self.config.num_vehicles, self.config.num_readings // 2
        thresholds = np.full(2 * (n - 1), pair_threshold)
        self.pair_sums = Sums(self.config, drift=drift, threshold=thresholds, release_s=release_s)
        self.fronts = np.concatenate([np.arange(n - 1), half + np.arange(n - 1)])
        self.rears = self.fronts + n
        self.deviation: FloatArray = np.sqrt(self.law.noise[self.fronts] + self.law.noise[self.rears])

    def blank(self) -> FloatArray:
        """Of each reading, then of each two that measure the same, see `Sums`."""
        return np.zeros((self.config.num_readings + len(self.fronts), 3))

    def trusted(self, seen: Seen, memory: FloatArray) -> BoolArray:
        """See the class."""
        readings = self.config.num_readings
        trust = super().trusted(seen, memory[:, :readings])
        told = np.concatenate([seen["range_error"], seen["range_rate"]], axis=1)
        differ = self.pair_sums.renew(
            memory[:, readings:], (told[:, self.fronts] - told[:, self.rears]) / self.deviation
        )
        trust[:, self.fronts] &= ~differ
        trust[:, self.rears] &= ~differ
        return trust
