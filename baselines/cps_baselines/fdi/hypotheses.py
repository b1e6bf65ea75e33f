"""A defender that weighs hypotheses about which sensors lie by their likelihoods; an extension beyond the paper."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cps_baselines.fdi.disturbance_filter import hypothesis_filters
from cps_baselines.fdi.platoon_filter import hear, platoon_filter
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, copy, fill, inlined, kernel, lend
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.fdi.config import FdiConfig


class Weights(NamedTuple):
    """The numbers of the defender; arrays (B,), one value for each episode of a batch."""

    range_cost: FloatArray  # nats a step that a hypothesis pays for a range that its filter leaves out
    rate_cost: FloatArray  # the same for a range-rate
    memory: FloatArray  # what is left of a hypothesis' odds after a step
    threshold: FloatArray  # log-odds in nats from which a hypothesis is followed,
    per_sensor: FloatArray  # and so much more for each sensor that it distrusts
    drift_threshold: FloatArray  # the same for the drift of the lead's gap, whose odds are not forgotten
    release: FloatArray  # part of these odds below which a hypothesis is given up again
    outlier: FloatArray  # deviations beyond which a filter leaves a reading out
    gate: FloatArray  # deviations beyond which the defender replaces a reading for a step
    correction: FloatArray  # which part of what a replaced reading is off the commands are corrected for
    caution: FloatArray  # m/s2 by which a vehicle brakes whose gap no trusted sensor sees


class Filters(NamedTuple):
    """What the kernel knows of the filters, see `HypothesisFilters`, of the platoon, and of the observation."""

    trusted: BoolArray  # (K, R)
    heard: BoolArray  # (K, R)
    gains: FloatArray  # (horizon + 1, R, 3n + 1, K) of innovations in deviations
    precisions: FloatArray  # (horizon + 1, R, K)
    surprise: FloatArray  # (horizon + 1, K)
    lasts: FloatArray  # (3n + 1, 3n + 1)
    command: FloatArray  # (2n, n)
    state: IntArray  # (R,) the error that a reading shows
    feedback: FloatArray  # (R, n) what each vehicle commands per unit of what a sensor tells it
    level_mps2: FloatArray  # (1,) of a correction
    levels: IntArray  # (1,) of corrections to either side
    horizon: IntArray  # (1,)
    offsets: Array  # (1,) of the observation
    scale: FloatArray  # (2, size)


class Scratch(NamedTuple):
    """What the kernel works with; one episode uses it after the other. All filters go side by side."""

    told: FloatArray  # (R,) readings
    moved: FloatArray  # (2n,) what the last commands did
    before: FloatArray  # (3n + 1, K)
    own: FloatArray  # (3n + 1, K) estimates
    values: FloatArray  # (R, K) innovations in deviations
    used: FloatArray  # (K,) that of a reading, where the filter hears it and it is no outlier, else 0
    misfit: FloatArray  # (K,) of what each filter heard, in nats
    wanted: FloatArray  # (n,) corrections in m/s2


class Hypotheses(AnalyticPolicy):
    """Follows the likeliest hypothesis about which sensors lie, once its log-odds against "none" are large enough.

    There is a filter for each hypothesis, see `disturbance_filter.hypothesis_filters`. The log-odds are Page's
    cumulative sums of log-likelihood ratios, so that a lie may begin at any time, and old evidence fades. Sensors that
    a hypothesis distrusts count as if they fitted at a constant cost; so a larger set has to explain more. The sensors
    of the followed hypothesis are replaced, and outliers of its filter for a step. What replaces them is the estimate
    of the platoon's filter, which has believed the lies so far: commands are corrected by what the hypothesis'
    own filter says instead. A vehicle whose gap no trusted sensor sees brakes a little, and so keeps more distance.

    Raises:
        ConfigurationError: options out of range, or no filter.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        range_cost: float = 0.8,
        rate_cost: float = 0.8,
        memory: float = 0.98,
        threshold: float = 10.0,
        per_sensor: float = 2.0,
        drift_threshold: float = 4.0,
        release: float = 0.3,
        outlier: float = 4.0,
        gate: float = 4.0,
        correction: float = 1.0,
        caution: float = 1.0,
    ) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config
        odds = (range_cost, rate_cost, memory, threshold, per_sensor, drift_threshold, release)
        numbers = (*odds, outlier, gate, correction, caution)
        self.weights = Weights(*(np.atleast_1d(np.asarray(number, float)) for number in numbers))
        if any(np.any(number < 0) for number in self.weights) or np.any(self.weights.memory > 1):
            raise ConfigurationError("hypotheses need numbers of 0 or more, and a memory of at most 1")
        self._filters, self._size = _filters(spec), 3 * self.config.num_vehicles + 1
        self._count = len(hypothesis_filters(self.config).heard)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Of each filter the estimate (B, 3n + 1, K) and the log-odds (B, K); the hypotheses that are followed (B,)."""
        count, filters = len(generators), self._count
        return np.zeros((count, self._size, filters)), np.zeros((count, filters)), np.zeros(count, np.int64)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, R + n)."""
        estimates, odds, follows = (part.copy() for part in state)
        actions = repeat(self.spec.neutral_action, len(seen))
        weights = Weights(*(np.resize(number, len(seen)) for number in self.weights))
        _judge(self._filters, weights, seen.observation, estimates, odds, follows, actions)
        return actions, (estimates, odds, follows)

    def beliefs(self, state: State) -> dict[str, Array]:
        """Log-odds of each hypothesis against its rivals, and the hypothesis that is followed."""
        return {"Hypothesis followed": state[2], "Log-odds of the hypotheses": state[1]}


def _filters(spec: RoleSpec) -> Any:
    """The `Filters` of a role's configuration, held for the kernel."""
    config: FdiConfig = spec.config
    law, known = platoon_filter(config), hypothesis_filters(config)
    n, half = config.num_vehicles, config.num_readings // 2
    feedback = np.zeros((config.num_readings, n))
    for j in range(config.num_readings):
        gain, place = config.proportional_gain if j < half else config.derivative_gain, j % half
        if place < n:
            feedback[j, place] = gain
        else:  # the rear sensor of the vehicle ahead
            feedback[j, place - n + 1] = -gain
    return hold(
        Filters(
            trusted=known.trusted,
            heard=known.heard,
            gains=np.ascontiguousarray((known.gains / known.precisions[..., np.newaxis]).transpose(0, 2, 3, 1)),
            precisions=np.ascontiguousarray(known.precisions.transpose(0, 2, 1)),
            surprise=known.surprise,
            lasts=known.lasts,
            command=law.command,
            state=law.view.argmax(axis=1),
            feedback=feedback,
            level_mps2=np.array([config.max_correction_mps2 / config.correction_levels]),
            levels=np.array([config.correction_levels]),
            horizon=np.array([config.horizon]),
            offsets=spec.fields.offsets,
            scale=spec.fields.scale,
        )
    )


@kernel
def _judge(
    filters: Filters,
    weights: Weights,
    observation: Observation,
    estimates: FloatArray,
    odds: FloatArray,
    follows: IntArray,
    actions: IntArray,
) -> None:
    """Renew estimates (B, 3n + 1, K), odds (B, K) and who is followed (B,), and write the actions (B, R + n)."""
    f, at = lend(filters), filters.offsets[0]
    (hypotheses, readings), n = f.trusted.shape, f.command.shape[1]
    side = (3 * n + 1, hypotheses)
    s = Scratch(
        np.empty(readings),
        np.empty(2 * n),
        np.empty(side),
        np.empty(side),
        np.empty((readings, hypotheses)),
        np.empty(hypotheses),
        np.empty(hypotheses),
        np.empty(n),
    )
    for b in range(observation.shape[0]):
        row = borrowed(observation)[b]
        step = f.horizon[0] - int(np.rint(decode_entry(row, f.scale, at.steps_left)))
        hear(row, at, f.scale, f.command, s.told, s.moved)
        for i in range(3 * n + 1):
            copy(borrowed(estimates)[b, i], s.own[i])
        if step > 0:
            predict(f, s)
        take(f, step, weights.outlier[b], s)
        for i in range(3 * n + 1):
            copy(s.own[i], borrowed(estimates)[b, i])
        best, most = 0, -np.inf
        for k in range(1, hypotheses):
            cost, needed = price(f, k, weights, b)
            kept = odds[b, k] if is_drift(f, k) else weights.memory[b] * odds[b, k]
            odds[b, k] = max(kept + s.misfit[0] - s.misfit[k] - cost - f.surprise[step, k], 0.0)
            enough = needed * (weights.release[b] if follows[b] == k else 1.0)
            if odds[b, k] >= enough and odds[b, k] - needed > most:
                best, most = k, odds[b, k] - needed
        follows[b] = best
        for j in range(readings):
            fits = abs(s.values[j, best]) <= weights.gate[b]
            actions[b, j] = 1 if f.trusted[best, j] and fits else 0
        correct(f, best, row, weights.correction[b], weights.caution[b], s)
        for i in range(n):
            level = int(np.rint(s.wanted[i] / f.level_mps2[0]))
            actions[b, readings + i] = f.levels[0] + min(max(level, -f.levels[0]), f.levels[0])


@inlined
def predict(f: Filters, s: Scratch) -> None:
    """Turn the estimates of the last step into the predictions of this one."""
    size, count = s.own.shape
    for i in range(size):
        moved = s.moved[i] if i < s.moved.size else 0.0
        for k in range(count):
            s.before[i, k] = s.own[i, k]
            s.own[i, k] = moved
    for i in range(size):
        for j in range(size):
            last = f.lasts[i, j]
            if last != 0.0:
                for k in range(count):
                    s.own[i, k] += last * s.before[j, k]


@inlined
def take(f: Filters, step: int, outlier: float, s: Scratch) -> None:
    """Take the readings into all filters, whose predictions become estimates; fill their innovations and misfits."""
    size, count = s.own.shape
    fill(s.misfit, 0.0)
    for j in range(s.told.size):
        told, place = s.told[j], f.state[j]
        for k in range(count):
            value = (told - s.own[place, k]) * f.precisions[step, j, k]
            s.values[j, k] = value
            within = abs(value) <= outlier
            s.used[k] = value if f.heard[k, j] and within else 0.0
            cost = 0.5 * value * value if within else 0.5 * outlier * outlier
            s.misfit[k] += cost if f.heard[k, j] else 0.0
        for i in range(size):
            for k in range(count):
                s.own[i, k] += f.gains[step, j, i, k] * s.used[k]


@inlined
def is_drift(f: Filters, k: int) -> bool:
    """Whether hypothesis k is the drift of the lead's gap."""
    return bool(k == f.trusted.shape[0] - 1)


@inlined
def price(f: Filters, k: int, weights: Weights, b: int) -> tuple[float, float]:
    """What hypothesis k pays in a step for the sensors that it leaves out, and the odds it needs, in nats."""
    cost, needed = 0.0, weights.threshold[b]
    for j in range(f.trusted.shape[1]):
        if not f.heard[k, j]:
            cost += weights.range_cost[b] if 2 * j < f.trusted.shape[1] else weights.rate_cost[b]
        if not f.trusted[k, j]:
            needed += weights.per_sensor[b]
    return cost, weights.drift_threshold[b] if is_drift(f, k) else needed


@inlined
def correct(f: Filters, k: int, row: Observation, part: float, caution: float, s: Scratch) -> None:
    """What commands (n,) lack where sensors are replaced: filter k's estimate against that of the platoon's filter.

    They lack `part` of that, and `caution` where nobody sees a gap.
    """
    at, readings, n = f.offsets[0], s.told.size, f.command.shape[1]
    fill(s.wanted, -caution)
    for j in range(readings):
        place = f.state[j]
        if f.trusted[k, j]:
            s.wanted[place % n] = 0.0
    for j in range(readings):
        place = f.state[j]
        if not f.trusted[k, j]:
            entry = at.predicted_gap_error + place if place < n else at.predicted_speed + place - n
            off = s.own[place, k] - decode_entry(row, f.scale, entry)
            for i in range(n):
                s.wanted[i] += part * f.feedback[j, i] * off
