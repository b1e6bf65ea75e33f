"""Defenders that test each reading against the filter of all readings; extensions beyond the paper.

Their base is that of all defenders that watch the filter's innovations.
"""

from __future__ import annotations

from abc import abstractmethod
from statistics import NormalDist

import numpy as np

from cps_baselines.fdi.platoon_filter import platoon_filter
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, Knowledge, State
from cps_envs.fdi.config import FdiConfig


class Suspicion(AnalyticPolicy):
    """Base: doubts readings of now, which the filter's estimate then replaces; commands are never corrected.

    Raises:
        ConfigurationError: the configuration has no filter.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config
        self.law = platoon_filter(self.config)

    @abstractmethod
    def blank(self) -> FloatArray:
        """What is remembered of an episode at its start, (...)."""

    @abstractmethod
    def trusted(self, seen: Seen, memory: FloatArray) -> BoolArray:
        """The readings (B, R) to use; renews what is remembered (B, ...)."""

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Nothing is known yet."""
        return (repeat(self.blank(), len(generators)),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, R + n): trust in every reading, then no correction."""
        memory = state[0].copy()
        actions = repeat(self.spec.neutral_action, len(seen))
        actions[:, : self.config.num_readings] = self.trusted(seen, memory)
        return actions, (memory,)


def innovations(seen: Seen) -> FloatArray:
    """The filter's innovations (B, R) in standard deviations."""
    by_kind = [seen[f"{kind}_innovation"] / seen[f"{kind}_deviation"] for kind in ("range", "rate")]
    return np.concatenate(by_kind, axis=1)


def of_radars(alarms: BoolArray) -> BoolArray:
    """Alarms (B, R) of single readings as alarms of both readings of the radar that gave them."""
    ranges, rates = np.split(alarms, 2, axis=1)
    return np.tile(ranges | rates, 2)


def gate_of(false_alarms: float) -> float:
    """How many standard deviations an honest reading exceeds in this part of the steps, to either side.

    Raises:
        ConfigurationError: not between 0 and 1.
    """
    if not 0 < false_alarms < 1:
        raise ConfigurationError(f"false_alarms = {false_alarms} must be between 0 and 1")
    return NormalDist().inv_cdf(1 - false_alarms / 2)


class Sums:
    """Two-sided cumulative sums (CUSUM, Page 1954) of normalised values, whose alarms are released after a time.

    The memory (B, K, 3) of K values: the sum above, the sum below, steps for which the alarm still holds.

    Raises:
        ConfigurationError: a negative drift or time, or no positive threshold.
    """

    def __init__(self, config: FdiConfig, *, drift: float, threshold: FloatArray, release_s: float) -> None:
        if drift < 0 or threshold.min() <= 0 or release_s < 0:
            raise ConfigurationError(
                f"drift = {drift} and release_s = {release_s} must be 0 or more, thresholds above 0"
            )
        self.drift, self.release_steps = drift, round(release_s / config.dt_s)
        self.threshold = threshold  # (K,)

    def renew(self, memory: FloatArray, values: FloatArray) -> BoolArray:
        """The alarms (B, K) that hold now, after the values (B, K)."""
        above, below, left = memory[..., 0], memory[..., 1], memory[..., 2]
        np.maximum(above + values - self.drift, 0.0, out=above)
        np.maximum(below - values - self.drift, 0.0, out=below)
        raised = (above > self.threshold) | (below > self.threshold)
        left -= 1
        left[raised] = self.release_steps
        np.maximum(left, 0.0, out=left)
        holds: BoolArray = left > 0
        above[holds] = below[holds] = 0.0
        return holds


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
