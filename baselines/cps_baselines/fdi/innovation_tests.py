"""Defenders that test each reading against the filter of all readings; extensions beyond the paper.

Their base is that of all defenders that watch the filter's innovations.
"""

from __future__ import annotations

from abc import abstractmethod
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.platoon_filter import platoon_filter
from cps_envs.core.compute.kernels import borrowed, fill, inlined, kernel
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.inside import InsidePolicy
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, Observation, State
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


def gate_of(false_alarms: float) -> float:
    """How many standard deviations an honest reading exceeds in this part of the steps, to either side.

    Raises:
        ConfigurationError: not between 0 and 1.
    """
    if not 0 < false_alarms < 1:
        raise ConfigurationError(f"false_alarms = {false_alarms} must be between 0 and 1")
    return NormalDist().inv_cdf(1 - false_alarms / 2)


class Known(NamedTuple):
    """What the tests of one reading after the other go by."""

    offsets: Array  # (1,) where the fields of the role begin
    scale: FloatArray  # (2, size) of their encoding
    largest: FloatArray  # (1,) deviations, of a reading that is trusted
    drift: FloatArray  # (1,) of the sums
    threshold: FloatArray  # (R,) of the sums; (0,) where nothing is summed up
    release_steps: FloatArray  # (1,) for which an alarm holds


class Memory(NamedTuple):
    """Of each reading its sum above, its sum below, and the steps for which its alarm still holds."""

    sums: FloatArray  # (B, R, 3), or (B, 0, 3)


@inlined
def add_up(sums: FloatArray, value: float, drift: float, threshold: float, release_steps: float) -> bool:
    """Add a value to the two-sided sums (3,) of `Memory` (CUSUM, Page 1954); whether an alarm holds now, which ends."""
    above, below = max(sums[0] + value - drift, 0.0), max(sums[1] - value - drift, 0.0)
    left = release_steps if above > threshold or below > threshold else max(sums[2] - 1.0, 0.0)
    sums[0], sums[1], sums[2] = (0.0, 0.0, left) if left > 0 else (above, below, left)
    return bool(left > 0)


@kernel
def judge(known: Known, memory: Memory, observation: Observation, trust: IntArray) -> None:
    """Fill the trust (B, R or more) in the readings that B observations show; an alarm doubts both of a radar's."""
    at, scale, sums = known.offsets[0], known.scale, memory.sums
    half = at.rate_innovation - at.range_innovation
    for b in range(trust.shape[0]):
        for j in range(2 * half):
            row, deviation = borrowed(observation)[b], at.range_deviation + j
            value = decode_entry(row, scale, at.range_innovation + j) / decode_entry(row, scale, deviation)
            trust[b, j] = 1 if abs(value) <= known.largest[0] else 0
            if known.threshold.size > 0:
                add_up(sums[b, j], value, known.drift[0], known.threshold[j], known.release_steps[0])
        if known.threshold.size > 0:
            for j in range(half):
                if sums[b, j, 2] > 0 or sums[b, half + j, 2] > 0:
                    trust[b, j] = trust[b, half + j] = 0


@inlined
def forget(known: Known, memory: Memory, stream: Array) -> None:
    """Begin an episode."""
    for j in range(memory.sums.shape[1]):
        fill(memory.sums[0, j], 0.0)


GATE = 0.01  # chosen: of the honest readings, step by step
DRIFT, THRESHOLD, RATE_THRESHOLD, RELEASE_S = 0.3, 14.0, 10.0, 2.0


class Tested(Suspicion):
    """Base of those that test each reading by itself, by `judge`."""

    known: Known

    def _know(self, gate: float, drift: float = 0, threshold: FloatArray | None = None, release_s: float = 0) -> None:
        least = np.inf if threshold is None else threshold.min()
        if drift < 0 or least <= 0 or release_s < 0:
            raise ConfigurationError(
                f"drift = {drift} and release_s = {release_s} must be 0 or more, thresholds above 0"
            )
        fields, steps = self.spec.fields, float(round(release_s / self.config.dt_s))
        largest, least_drift = np.array([gate_of(gate)]), np.array([drift], np.float64)
        limits = np.zeros(0) if threshold is None else threshold
        self.known = Known(fields.offsets, fields.scale, largest, least_drift, limits, np.array([steps]))

    def blank(self) -> FloatArray:
        """The sums of `Memory`."""
        return np.zeros((self.known.threshold.size, 3))

    def trusted(self, seen: Seen, memory: FloatArray) -> BoolArray:
        """See the class."""
        trust = np.empty((len(seen), self.config.num_readings), np.int64)
        judge(self.known, Memory(memory), seen.observation, trust)
        return trust > 0

    def inside(self) -> InsidePolicy:
        """`judge` of one environment."""
        return InsidePolicy(self.known, lambda count: Memory(repeat(self.blank(), count)), forget, judge)


class Chi2(Tested):
    """Rejects a reading for one step when it fails a chi-squared test with one degree of freedom.

    `gate` is the part of the honest readings that it doubts. It is blind to lies that stay within the gate; and once
    such lies have deceived the filter, it is the honest readings that lie outside.

    Raises:
        ConfigurationError: a gate that is no probability, or no filter.
    """

    def __init__(self, spec: RoleSpec, *, gate: float = GATE) -> None:
        super().__init__(spec)
        self._know(gate)


class Cusum(Tested):
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
        thresholds = np.repeat([threshold, rate_threshold], self.config.num_readings // 2)
        self._know(gate, drift, thresholds, release_s)
