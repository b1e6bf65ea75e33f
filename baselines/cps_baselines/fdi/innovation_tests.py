"""Defenders that test each reading against the filter of all readings; extensions beyond the paper."""

from __future__ import annotations

import numpy as np

from cps_baselines.fdi.suspicion import Sums, Suspicion, gate_of, innovations, of_radars
from cps_envs.core.policy import RoleSpec
from cps_envs.core.seen import Seen
from cps_envs.core.types import BoolArray, FloatArray

GATE = 0.01  # chosen: of the honest readings, step by step
DRIFT, THRESHOLD, RATE_THRESHOLD, RELEASE_S = 0.3, 14.0, 10.0, 2.0


class Chi2(Suspicion):
    """Rejects a reading for one step when it fails a chi-squared test with one degree of freedom.

    `gate` is the part of the honest readings that it doubts. It is blind to lies that stay within the gate; and once
    such lies have deceived the filter, it is the honest readings that lie outside.

    Raises:
        ConfigurationError: a gate that is no probability, or no filter.
    """

    def __init__(self, spec: RoleSpec, *, gate: float = GATE) -> None:
        super().__init__(spec)
        self.largest = gate_of(gate)

    def blank(self) -> FloatArray:
        """Nothing."""
        return np.zeros(0)

    def trusted(self, seen: Seen, memory: FloatArray) -> BoolArray:
        """See the class."""
        return np.abs(innovations(seen)) <= self.largest


class Cusum(Suspicion):
    """Rejects a radar for `release_s` when its innovations add up, and single outliers for one step.

    Two-sided sums of what each normalised innovation has above `drift`; an alarm at `threshold`, or `rate_threshold`
    for range-rates, clears them and excludes both readings of the radar: whoever owns one of them may own the other.
    The filter expects more of a range-rate than a disturbance that lasts does to it, hence the lower threshold.
    A latched alarm would leave a vehicle without its sensor for good, which ends in collisions without any attack.

    Raises:
        ConfigurationError: options out of range, or no filter.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        drift: float = DRIFT,
        threshold: float = THRESHOLD,
        rate_threshold: float = RATE_THRESHOLD,
        release_s: float = RELEASE_S,
        gate: float = GATE,
    ) -> None:
        super().__init__(spec)
        self.largest = gate_of(gate)
        thresholds = np.repeat([threshold, rate_threshold], self.config.num_readings // 2)
        self.sums = Sums(self.config, drift=drift, threshold=thresholds, release_s=release_s)

    def blank(self) -> FloatArray:
        """Of each reading, see `Sums`."""
        return np.zeros((self.config.num_readings, 3))

    def trusted(self, seen: Seen, memory: FloatArray) -> BoolArray:
        """See the class."""
        values = innovations(seen)
        return ~of_radars(self.sums.renew(memory, values)) & (np.abs(values) <= self.largest)
