"""The start of episodes: what a reset draws, and the state at k = 0."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_envs.core.config import IntRange, bounds
from cps_envs.core.kernels import fill, inlined
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.disturbance import Disturbance
from cps_envs.hvac.filtering import start_filters
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.sensors import attack_order
from cps_envs.hvac.state import State

UNCERTAIN = 1e4  # initial variance of the recursive least squares, in units of sigma^2


class Draws:
    """Draws episodes in the order that their numbers depend on, into the state.

    What the configuration leaves exact is drawn too, so that the order is always the same; only courses that it leaves
    out are not, which come last. Noise comes first: configurations that differ in the attack or in the plant only have
    the same noise.
    """

    def __init__(self, config: HvacConfig) -> None:
        self._onset, self._size = _whole(config.onset_step), _whole(config.num_compromised)
        self._order: IntArray = np.array(attack_order(config)) - 1
        self._random = config.random_compromise
        self._ends: FloatArray = np.cumsum(np.array(config.compromised_weights, np.float64))
        self._disturbance = Disturbance(config)

    def draw(self, state: State, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        """Episodes of the marked environments (B,); `plant` and `heat` become uniform numbers in [0, 1)."""
        state.compromised[envs] = False
        for b in np.flatnonzero(envs).tolist():
            generator = generators[b]
            generator.standard_normal(out=state.series[b])
            state.onset[b], size = generator.integers(*self._onset), self._draw_size(generator)
            shuffled = generator.permutation(len(self._order))
            group = (self._order[shuffled] if self._random else self._order)[:size]
            state.compromised[b, group] = True
            generator.random(out=state.plant[b])
            generator.random(out=state.heat[b])
            self._disturbance.draw(generator, state.heat_drift[b], state.outdoor_error[b])

    def _draw_size(self, generator: np.random.Generator) -> int:
        """The number of compromised sensors."""
        if len(self._ends) == 0:
            return int(generator.integers(*self._size))
        return int(self._ends.searchsorted(self._ends[-1] * generator.random(), side="right"))


def _whole(value: IntRange) -> tuple[int, int]:
    low, high = bounds(value)
    return int(low), int(high) + 1


@inlined
def start(model: Model, rules: Rules, episode: State) -> None:
    """Put a drawn episode at k = 0: all zones at the initial temperature, heating off, sums and windows empty."""
    n, sensors = len(model.B), len(model.zone)
    for i in range(n):
        episode.heat[i] = rules.unmeasured_heat_w * (2.0 * episode.heat[i] - 1.0)
        for j in range(n):
            beta = rules.model_error * (2.0 * episode.plant[i, j] - 1.0)
            episode.plant[i, j] = (1.0 if i == j else 0.0) + model.rate[i, j] * (1.0 + beta)
            episode.covariance[i, j] = UNCERTAIN if i == j else 0.0
    fill(episode.temperature, rules.initial_c)
    for vector in (episode.forced, episode.integrator, episode.heating, episode.recursive, episode.fed):
        fill(vector, 0.0)
    for vector in (episode.residual, episode.residual_sum, episode.mean_residual, episode.absolute_error):
        fill(vector, 0.0)
    fill(episode.used, False)
    fill(episode.squared_by_zone, 0.0)
    fill(episode.estimate.reshape(-1), 0.0)
    fill(episode.plan.reshape(-1), 0.0)
    start_filters(rules, episode)
    episode.step[0], episode.choice[0] = 0, 0
    episode.squared_error[0], episode.energy_j[0] = 0.0, 0.0
    metrics = episode.metrics[0]
    metrics.distinct_sets, metrics.flawed_steps, metrics.model_steps, metrics.rejecting_steps = 0.0, 0.0, 0.0, 0.0
    metrics.discomfort_h, metrics.attack_kwh = 0.0, 0.0
    metrics.onset_step, metrics.num_compromised = episode.onset[0], 0.0
    for s in range(sensors):
        metrics.num_compromised += episode.compromised[s]
