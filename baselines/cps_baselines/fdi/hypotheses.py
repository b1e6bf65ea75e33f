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
    gains: FloatArray  # (horizon + 1, K, R, 3n + 1)
    precisions: FloatArray  # (horizon + 1, K, R)
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
    """What the kernel works with; one episode uses it after the other."""

    told: FloatArray  # (R,) readings
    moved: FloatArray  # (2n,) what the last commands did
    before: FloatArray  # (3n + 1,)
    values: FloatArray  # (K, R) innovations in deviations
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
        """Of each filter the estimate (B, K, 3n + 1) and the log-odds (B, K); the hypotheses that are followed (B,)."""
        shape = (len(generators), self._count)
        return np.zeros((*shape, self._size)), np.zeros(shape), np.zeros(len(generators), np.int64)

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
            gains=known.gains,
            precisions=known.precisions,
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
    """Renew estimates (B, K, 3n + 1), odds (B, K) and who is followed (B,), and write the actions (B, R + n)."""
    f, at = lend(filters), filters.offsets[0]
    (hypotheses, readings), n = f.trusted.shape, f.command.shape[1]
    s = Scratch(np.empty(readings), np.empty(2 * n), np.empty(3 * n + 1), np.empty((hypotheses, readings)), np.empty(n))
    for b in range(observation.shape[0]):
        row = borrowed(observation)[b]
        step = f.horizon[0] - int(np.rint(decode_entry(row, f.scale, at.steps_left)))
        hear(row, at, f.scale, f.command, s.told, s.moved)
        honest, best, most = 0.0, 0, -np.inf
        for k in range(hypotheses):
            own = borrowed(estimates)[b, k]
            if step > 0:
                predict(f, own, s)
            misfit = take(f, step, k, own, weights.outlier[b], s.told, borrowed(s.values)[k])
            if k == 0:
                honest = misfit
                continue
            cost, needed = price(f, k, weights, b)
            kept = odds[b, k] if is_drift(f, k) else weights.memory[b] * odds[b, k]
            odds[b, k] = max(kept + honest - misfit - cost - f.surprise[step, k], 0.0)
            enough = needed * (weights.release[b] if follows[b] == k else 1.0)
            if odds[b, k] >= enough and odds[b, k] - needed > most:
                best, most = k, odds[b, k] - needed
        follows[b] = best
        for j in range(readings):
            fits = abs(s.values[best, j]) <= weights.gate[b]
            actions[b, j] = 1 if f.trusted[best, j] and fits else 0
        correct(f, best, row, borrowed(estimates)[b, best], weights.correction[b], weights.caution[b], s)
        for i in range(n):
            level = int(np.rint(s.wanted[i] / f.level_mps2[0]))
            actions[b, readings + i] = f.levels[0] + min(max(level, -f.levels[0]), f.levels[0])


@inlined
def predict(f: Filters, own: FloatArray, s: Scratch) -> None:
    """Turn the estimate (3n + 1,) of the last step into the prediction of this one."""
    n = f.command.shape[1]
    copy(own, s.before)
    for i in range(own.size):
        own[i] = s.moved[i] if i < 2 * n else 0.0
        for k in range(own.size):
            own[i] += f.lasts[i, k] * s.before[k]


@inlined
def take(f: Filters, step: int, k: int, own: FloatArray, outlier: float, told: FloatArray, values: FloatArray) -> float:
    """Take readings (R,) into filter k, whose prediction (3n + 1,) becomes its estimate.

    `values` (R,) are filled with the normalised innovations. Returns the misfit of what it heard, in nats.
    """
    misfit = 0.0
    for j in range(told.size):
        values[j] = (told[j] - own[f.state[j]]) * f.precisions[step, k, j]
        if f.heard[k, j]:
            if abs(values[j]) > outlier:
                misfit += 0.5 * outlier * outlier
                continue
            misfit += 0.5 * values[j] * values[j]
            for i in range(own.size):
                own[i] += f.gains[step, k, j, i] * values[j] / f.precisions[step, k, j]
    return misfit


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
def correct(f: Filters, k: int, row: Observation, own: FloatArray, part: float, caution: float, s: Scratch) -> None:
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
            off = own[place] - decode_entry(row, f.scale, entry)
            for i in range(n):
                s.wanted[i] += part * f.feedback[j, i] * off
