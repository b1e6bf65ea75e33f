"""A defender that weighs every set of liars by Bayes' rule, and believes the estimate with the least expected error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_baselines.hvac.hypotheses import BIAS_KEPT, START, Beliefs, HypothesisTables, hypotheses
from cps_baselines.hvac.replacing import elapsed_steps
from cps_envs.core.compute.kernels import copy, fill, inlined, kernel, lend
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.dynamics import drift
from cps_envs.hvac.kalman import memory
from cps_envs.hvac.model import Model, build_model
from cps_envs.hvac.sensors import sensor_sets

MOST_SQUARED = 100.0  # of an innovation in standard deviations: one reading cannot decide alone
LIKELY = 1e-3  # hypotheses this much less likely than the first do not count in the choice


class Bayes(AnalyticPolicy):
    """Multiple-model estimation (Magill 1965): one Kalman filter for each set of liars, weighed by its likelihood.

    A filter that takes sensors for liars estimates their biases, so it does not believe them, but it still asks whether
    their readings are those of somebody who lies smoothly. Nobody lies until an attack begins, with a constant
    hazard; then each hypothesis goes on from what was known before (Blom and Bar-Shalom 1988). The choice is the
    offered estimate with the least expected squared error over the hypotheses.

    `beliefs` has one set of numbers for all episodes, or one for each.

    Raises:
        ConfigurationError: a configuration without Kalman filters, or beliefs out of their bounds.
    """

    def __init__(self, spec: RoleSpec, *, beliefs: Sequence[Beliefs] = (START,)) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        if not self.config.kalman_filters:
            raise ConfigurationError("no Kalman filters are offered here: set kalman_filters=true")
        for each in beliefs:
            _check(each)
        self._model = build_model(self.config)
        tables = {each: hypotheses(self.config, each) for each in beliefs}
        place = {each: row for row, each in enumerate(tables)}
        self._rows = np.array([place[each] for each in beliefs])
        stacked = (np.array(part) for part in zip(*tables.values(), strict=True))  # each (P, ...)
        self._tables = HypothesisTables(*stacked)
        self._memory, self._unready = memory(self.config), len(sensor_sets(self.config)) + 1
        self.lies = self._tables.lies[0]  # (H, S) whom each hypothesis takes for a liar, 0 or 1

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The estimates (B, H, 2n + 2S), the logarithms (B, H) of the weights, and which beliefs (B,)."""
        envs, (_, count, size, _) = len(generators), self._tables.gain.shape
        estimates, weights = np.zeros((envs, count, size)), np.full((envs, count), -np.inf)
        estimates[:, :, : self.config.num_zones], weights[:, 0] = self.config.initial_c, 0.0
        return estimates, weights, self._rows[np.arange(envs) % len(self._rows)]

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        renewed = self.weighed(seen, state)
        return self.chosen(seen, renewed, renewed[1], np.ones(len(seen))), renewed

    def weighed(self, seen: Seen, state: State) -> tuple[FloatArray, FloatArray, IntArray]:
        """The state with what is read now."""
        estimates, weights, rows = (part.copy() for part in state)
        k = elapsed_steps(seen, self.config)
        observed = seen["wall_c"].shape[1] > 0
        walls = seen["wall_c"] if observed else self._model.weather[np.maximum(k - 1, 0)]
        inputs = (seen["heating"], walls, seen["reading"])
        weigh(self._model, self._tables, self._memory, rows, k, *inputs, estimates, weights)
        return estimates, weights, rows

    def chosen(self, seen: Seen, state: State, weights: FloatArray, caution: FloatArray) -> Array:
        """Choices (B,) by the estimates of a state, and the logarithms (B, H) of weights, of which the largest is 0.

        An estimate that is too cold is `caution` (B,) times as bad as the beliefs say.
        """
        estimates, _, rows = state
        ready, choice = seen["ready"] > 0.5, np.full(len(seen), self._unready)
        if ready.any():
            choose(seen["estimate"][:, 1:], estimates, weights, caution * self._tables.too_cold[rows], choice)
        return np.where(ready, 1 + choice, self._unready)

    def beliefs(self, state: State) -> dict[str, Array]:
        """The probability of each hypothesis; the first one is that nobody lies."""
        likely = np.exp(state[1] - state[1].max(axis=1, keepdims=True))
        return {"Probability of each set of liars (first: nobody)": likely / likely.sum(axis=1, keepdims=True)}


def _check(beliefs: Beliefs) -> None:
    *positive, together = beliefs
    if not (min(positive) > 0 and np.isfinite(positive).all()):
        raise ConfigurationError(f"{beliefs}: all numbers but `together` have to be positive")
    if not 0 <= together < 1:
        raise ConfigurationError(f"together = {together}: it has to be at least 0 and below 1")


@kernel
def weigh(
    model: Model,
    tables: HypothesisTables,
    heat_kept: float,
    rows: IntArray,
    steps: IntArray,
    heating: FloatArray,
    walls: FloatArray,
    reading: FloatArray,
    estimates: FloatArray,
    weights: FloatArray,
) -> None:
    """Bring estimates (B, H, 2n + 2S) and log weights (B, H) up to the readings (B, S) of the steps (B,).

    Since the step before there were `heating` (B, n), W, and `walls` (B, n), C behind them.
    """
    building, t = lend(model), lend(tables)
    n, hypotheses, innovation = len(building.B), weights.shape[1], np.empty(reading.shape[1])
    heat, temperature, mean = np.empty(n), np.empty(n), np.empty(estimates.shape[2])
    for b in range(len(rows)):
        row, z, w = rows[b], estimates[b], weights[b]
        begin_attack(t.prior[row], t.onset[row], z, w)
        change_kinds(t.kinds[row], t.change[row], mean, z, w)
        most = -np.inf
        for h in range(hypotheses):
            if steps[b] > 0:
                for i in range(n):
                    heat[i] = heating[b, i] + z[h, n + i]
                drift(building.A, building, z[h, :n], heat, walls[b], temperature)
                copy(temperature, z[h, :n])
                grow(z[h], n, heat_kept, t.growth_kept[row])
            for s in range(len(innovation)):
                lie = z[h, 2 * n + s] * t.lies[row, h, s]
                innovation[s] = reading[b, s] - z[h, building.zone[s]] - lie
            likely = t.offset[row, h] - 0.5 * min(squared(t.whiten[row, h], innovation), MOST_SQUARED)
            add_product(t.gain[row, h], innovation, z[h])
            w[h] += t.trust[row] * likely
            most = max(most, w[h])
        for h in range(hypotheses):
            w[h] -= most


@inlined
def begin_attack(prior: FloatArray, onset: float, z: FloatArray, w: FloatArray) -> None:
    """An attack may have begun: hypotheses (H,) get weight and knowledge from the first one, that nobody lies."""
    for h in range(1, len(w)):
        coming = w[0] + np.log(onset * prior[h])
        most = max(w[h], coming)
        total = most + np.log(np.exp(w[h] - most) + np.exp(coming - most))
        share = np.exp(coming - total)
        for i in range(z.shape[1]):
            z[h, i] += share * (z[0, i] - z[h, i])
        w[h] = total
    w[0] += np.log(1.0 - onset)


@inlined
def change_kinds(kinds: FloatArray, change: float, mean: FloatArray, z: FloatArray, w: FloatArray) -> None:
    """The liars of each set may have turned to another kind: the kinds mix their weight and knowledge."""
    for first in range(1, len(w), len(kinds)):
        most, total = -np.inf, 0.0
        for h in range(first, first + len(kinds)):
            most = max(most, w[h])
        fill(mean, 0.0)
        for h in range(first, first + len(kinds)):
            weight = np.exp(w[h] - most)
            total += weight
            for i in range(len(mean)):
                mean[i] += weight * z[h, i]
        for j in range(len(kinds)):
            h, coming = first + j, change * kinds[j] * total
            staying = (1.0 - change) * np.exp(w[h] - most)
            for i in range(len(mean)):
                z[h, i] = (staying * z[h, i] + change * kinds[j] * mean[i]) / (staying + coming)
            w[h] = most + np.log(staying + coming)


@inlined
def grow(z: FloatArray, n: int, heat_kept: float, growth_kept: float) -> None:
    """Heat and biases of a hypothesis (2n + 2S,) one step later."""
    sensors = len(z) // 2 - n
    for i in range(n, 2 * n):
        z[i] *= heat_kept
    for s in range(2 * n, 2 * n + sensors):
        z[s] = BIAS_KEPT * z[s] + z[s + sensors]
        z[s + sensors] *= growth_kept


@inlined
def squared(whiten: FloatArray, innovation: FloatArray) -> float:
    """The squared length of whitened innovations (S,)."""
    total = 0.0
    for i in range(len(innovation)):
        part = 0.0
        for j in range(i + 1):
            part += whiten[i, j] * innovation[j]
        total += part * part
    return total


@inlined
def add_product(matrix: FloatArray, vector: FloatArray, to: FloatArray) -> None:
    """Add a matrix (m, k) times a vector (k,) to another (m,)."""
    for i in range(len(to)):
        for j in range(len(vector)):
            to[i] += matrix[i, j] * vector[j]


@kernel
def choose(
    offered: FloatArray, estimates: FloatArray, weights: FloatArray, too_cold: FloatArray, choice: IntArray
) -> None:
    """Write the choices (B,) of the `offered` estimates (B, choices, n) with the least expected squared error.

    An error counts `too_cold` (B,) times where the estimate is below the temperature.
    """
    n, likely, probability = offered.shape[2], np.empty(weights.shape[1], np.int64), np.exp(weights)
    for b in range(len(choice)):
        count, least = 0, np.inf
        for h in range(len(likely)):
            if probability[b, h] > LIKELY:
                likely[count] = h
                count += 1
        for a in range(offered.shape[1]):
            error = 0.0
            for j in range(count):
                if error >= least:  # it only grows
                    break
                h, squares = likely[j], 0.0
                for i in range(n):
                    difference = offered[b, a, i] - estimates[b, h, i]
                    weight = too_cold[b] if difference < 0.0 else 1.0
                    squares += weight * difference * difference
                error += probability[b, h] * squares
            if error < least:
                least, choice[b] = error, a
