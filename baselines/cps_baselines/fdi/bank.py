"""A defender with a bank of filters, one for each set of sensors that may be honest; an extension beyond the paper."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.innovation_tests import DRIFT, GATE, RATE_THRESHOLD, THRESHOLD, gate_of
from cps_baselines.fdi.platoon_filter import gains_of, hear, platoon_filter
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, inlined, kernel, lend
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.estimation import state_of

MOST = 2.0  # thresholds that a sum can reach, so that it falls below one again when a lie ends


class FilterBank(NamedTuple):
    """K filters that trust sets of sensors, the largest sets first."""

    trusted: BoolArray  # (K, R)
    gains: FloatArray  # (horizon + 1, K, R, 2n)
    precisions: FloatArray  # (horizon + 1, K, R) of innovations, one over their deviations
    state: IntArray  # (R,) the error that a reading shows
    command: FloatArray  # (2n, n)
    dt_s: FloatArray  # (1,)
    offsets: Array  # (1,) of the observation
    scale: FloatArray  # (2, size)
    drift: FloatArray  # (1,)
    thresholds: FloatArray  # (R,)
    gate: FloatArray  # (1,)


class Bank(AnalyticPolicy):
    """Uses the largest set of sensors that agree: those of the first filter without an alarm.

    There is a filter of all sensors, and one without each group of sensors of one gap. Each has two-sided sums of its
    own innovations; where every filter has an alarm the one with the smallest sum decides. A filter leaves out what
    lies outside its gate, and the defender what lies outside that of the filter it follows; `gate` is the part of the
    honest readings there.

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
        gate: float = GATE,
    ) -> None:
        super().__init__(spec)
        if drift < 0 or min(threshold, rate_threshold) <= 0:
            raise ConfigurationError(
                f"a bank needs drift >= 0 and thresholds > 0; got {drift}, {threshold} and {rate_threshold}"
            )
        self.config: FdiConfig = spec.config
        law = platoon_filter(self.config)
        sets, gains, precisions = filters_of(self.config)
        filters = FilterBank(
            trusted=sets,
            gains=gains,
            precisions=precisions,
            state=law.view.argmax(axis=1),
            command=law.command,
            dt_s=np.array([self.config.dt_s]),
            offsets=spec.fields.offsets,
            scale=spec.fields.scale,
            drift=np.array([drift]),
            thresholds=np.repeat([threshold, rate_threshold], self.config.num_readings // 2),
            gate=np.array([gate_of(gate)]),
        )
        self._sets, self._filters = sets, hold(filters)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The filters' predictions (B, K, 2n), and sums (B, K, R, 2) above and below."""
        shape = (len(generators), len(self._sets))
        return np.zeros((*shape, 2 * self.config.num_vehicles)), np.zeros((*shape, self.config.num_readings, 2))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, R + n)."""
        predictions, sums = state[0].copy(), state[1].copy()
        actions = repeat(self.spec.neutral_action, len(seen))
        _judge(self._filters, self.config.horizon, seen.observation, predictions, sums, actions)
        return actions, (predictions, sums)

    def beliefs(self, state: State) -> dict[str, Array]:
        """The largest sum of each filter: how much it doubts what it hears."""
        return {"Largest sum of each filter": state[1].max(axis=(2, 3))}


@lru_cache(maxsize=8)
def filters_of(config: FdiConfig) -> tuple[BoolArray, FloatArray, FloatArray]:
    """What a `FilterBank` holds of sets, gains and precisions; it takes a third of a second."""
    sets = honest_sets(config)
    gains, deviations = gains_of(platoon_filter(config), list(sets), config.horizon + 1)
    return sets, np.ascontiguousarray(gains.swapaxes(2, 3)), 1 / deviations


def honest_sets(config: FdiConfig) -> BoolArray:
    """Sets of sensors (K, R): all, and all but each group of sensors of one gap; larger sets first."""
    n, readings = config.num_vehicles, config.num_readings
    pair_of = np.array([state_of(j, n, readings) % n for j in range(readings)])
    sets = [np.ones(readings, np.bool_)]
    for pair in range(n):
        own = np.flatnonzero(pair_of == pair)
        for choice in product((True, False), repeat=len(own)):
            marks = np.ones(readings, np.bool_)
            marks[own] = choice
            if not all(choice):
                sets.append(marks)
    return np.array(sorted(sets, key=lambda marks: -int(marks.sum())))


@kernel
def _judge(
    filters: FilterBank,
    horizon: int,
    observation: Observation,
    predictions: FloatArray,
    sums: FloatArray,
    actions: IntArray,
) -> None:
    """Renew every filter by the observations (B, size), and write the trust (B, R) into the actions (B, R + n)."""
    f, at = lend(filters), filters.offsets[0]
    readings, n = f.trusted.shape[1], f.command.shape[1]
    told, moved, values = np.empty(readings), np.empty(2 * n), np.empty((f.trusted.shape[0], readings))
    for b in range(observation.shape[0]):
        row = borrowed(observation)[b]
        step = horizon - int(np.rint(decode_entry(row, f.scale, at.steps_left)))
        hear(row, at, f.scale, f.command, told, moved)
        chosen, least = 0, np.inf
        for k in range(f.trusted.shape[0]):
            own = borrowed(predictions)[b, k]
            if step > 0:
                for i in range(n):
                    own[i] += f.dt_s[0] * own[n + i] + moved[i]
                    own[n + i] += moved[n + i]
            worst = renew(f, step, k, told, own, borrowed(sums)[b, k], borrowed(values)[k])
            if worst < least and least >= 1:
                chosen, least = k, worst
        for j in range(readings):
            fits = abs(values[chosen, j]) <= f.gate[0]
            actions[b, j] = 1 if f.trusted[chosen, j] and fits else 0


@inlined
def renew(
    f: FilterBank, step: int, k: int, told: FloatArray, own: FloatArray, sums: FloatArray, values: FloatArray
) -> float:
    """Take readings (R,) into filter k, whose prediction (2n,) becomes its estimate.

    `sums` (R, 2) go on, and `values` (R,) are filled with the normalised innovations. Returns the largest sum as part
    of its threshold.
    """
    readings, worst = told.size, 0.0
    for j in range(readings):
        values[j] = (told[j] - own[f.state[j]]) * f.precisions[step, k, j]
    for j in range(readings):
        if f.trusted[k, j] and abs(values[j]) <= f.gate[0]:
            innovation = values[j] / f.precisions[step, k, j]
            for i in range(own.size):
                own[i] += f.gains[step, k, j, i] * innovation
    for j in range(readings):
        if f.trusted[k, j]:
            most = MOST * f.thresholds[j]
            sums[j, 0] = min(max(sums[j, 0] + values[j] - f.drift[0], 0.0), most)
            sums[j, 1] = min(max(sums[j, 1] - values[j] - f.drift[0], 0.0), most)
            worst = max(worst, sums[j, 0] / f.thresholds[j], sums[j, 1] / f.thresholds[j])
    return worst
