"""The start of episodes: what a reset draws, and the state at k = 0."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import borrowed, fill, inlined, pack, room
from cps_envs.core.compute.streams import fill_normal, fill_uniform, shuffle, uniform, whole
from cps_envs.core.declare.config import bounds
from cps_envs.core.types import Array, FloatArray, IntArray
from cps_envs.hvac.building import places_of
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.disturbance import Drift, draw_disturbance, drift_of
from cps_envs.hvac.filtering import start_filters
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.sensors import attack_order
from cps_envs.hvac.state import Scratch, State

UNCERTAIN = 1e4  # initial variance of the recursive least squares, in units of sigma^2


class Chances(NamedTuple):
    """The ranges from which an attack's onset and number of compromised sensors are drawn."""

    first_onset: int
    last_onset: int
    fewest_compromised: int
    most_compromised: int
    random_order: bool  # sensors fall in any order


class Draws(NamedTuple):
    """Everything that a reset draws from."""

    chances: Array  # (1,) of Chances
    drift: Array  # (1,) of Drift
    order: IntArray  # (S,) in which sensors fall, counted from 0
    first: IntArray  # (2, m) samples at which episodes of each half of the series may begin
    counts: IntArray  # (2,) how many
    ends: FloatArray  # (k,) cumulated weights of 0, 1, ... compromised sensors; (0,) where all numbers are as likely


def draws_of(config: HvacConfig) -> Draws:
    """What a configuration leaves to chance."""
    onset, compromised = bounds(config.onset_step), bounds(config.num_compromised)
    first, last, fewest, most = (int(end) for end in (*onset, *compromised))
    return Draws(
        pack(Chances(first, last, fewest, most, config.random_compromise)),
        pack(drift_of(config)),
        np.array(attack_order(config), np.int64) - 1,
        *places_of(config)[:2],
        np.cumsum(np.array(config.compromised_weights, np.float64)),
    )


@inlined
def draw(
    stream: Array, chance: Chances, drift: Drift, draws: Draws, half: int, episode: State, scratch: Scratch
) -> None:
    """Draw an episode from its stream (6,); `plant` and `heat` become uniform numbers in [0, 1).

    What the configuration leaves exact is drawn too, so that the order is always the same; only courses that it leaves
    out are not, which come last, and the place in series where there is but one. Noise comes first: configurations that
    differ in the attack or in the plant only have the same noise.
    """
    fill_normal(stream, episode.series.reshape(-1))
    episode.onset[0] = whole(stream, chance.first_onset, chance.last_onset + 1)
    size = draw_size(stream, chance, draws.ends)
    places = room(draws.order.size, np.int64)
    shuffle(stream, borrowed(places))
    fill(episode.compromised, False)
    for i in range(size):
        episode.compromised[draws.order[places[i] if chance.random_order else i]] = True
    fill_uniform(stream, episode.plant.reshape(-1))
    fill_uniform(stream, episode.heat)
    draw_disturbance(stream, drift, episode.heat_drift, episode.outdoor_error, scratch.vector, scratch.change)
    episode.first[0] = draws.first[half, whole(stream, 0, draws.counts[half])]


@inlined
def draw_size(stream: Array, chance: Chances, ends: FloatArray) -> Any:
    """The number of compromised sensors."""
    if ends.size == 0:
        return whole(stream, chance.fewest_compromised, chance.most_compromised + 1)
    share, size = ends[-1] * uniform(stream), 0
    while size < ends.size and ends[size] <= share:
        size += 1
    return size


@inlined
def start(model: Model, rules: Rules, episode: State) -> None:
    """Put a drawn episode at k = 0: all zones at the initial temperature, heating off, sums and windows empty."""
    n, sensors = len(episode.temperature), len(episode.measured)
    for i in range(n):
        episode.heat[i] = rules.unmeasured_heat_w * (2.0 * episode.heat[i] - 1.0)
        for j in range(n):
            beta = rules.model_error * (2.0 * episode.plant[i, j] - 1.0)
            episode.plant[i, j] = (1.0 if i == j else 0.0) + model.rate[i, j] * (1.0 + beta)
            episode.covariance[i, j] = UNCERTAIN if i == j else 0.0
    fill(episode.temperature, rules.initial_c)
    for vector in (episode.forced, episode.integrator, episode.heating, episode.recursive, episode.fed):
        fill(vector, 0.0)
    for vector in (episode.supplied, episode.shift):
        fill(vector, 0.0)
    fill(episode.denied, False)
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
