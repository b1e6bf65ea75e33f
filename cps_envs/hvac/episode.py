"""Drawing the episodes of an episode, and putting an episode at its start."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.config import IntRange, bounds
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.hvac.building import transition
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.estimation import UNCERTAIN
from cps_envs.hvac.sensors import attack_order
from cps_envs.hvac.state import State


class Episode(NamedTuple):
    """What a reset draws for one episode."""

    noise: FloatArray  # (K, S) standard normal
    onset: int  # t_0, step
    compromised: BoolArray  # (S,)
    plant: FloatArray  # (n, n) A_p
    heat_w: FloatArray  # (n,) unmeasured


def draw_episode(config: HvacConfig, generator: np.random.Generator) -> Episode:
    """One episode; what the configuration leaves exact is drawn too, so that the order of draws is always the same.

    Noise comes first: configurations that differ in the attack or in the plant only have the same noise.
    """
    zones, sensors = config.num_zones, config.num_sensors
    noise = generator.standard_normal((config.num_steps, sensors))
    onset, size = _draw_whole(config.onset_step, generator), _draw_whole(config.num_compromised, generator)
    order, shuffled = np.array(attack_order(config)), generator.permutation(len(attack_order(config)))
    group = (order[shuffled] if config.random_compromise else order)[:size]
    beta = config.model_error * generator.uniform(-1.0, 1.0, (zones, zones))
    heat_w = config.unmeasured_heat_w * generator.uniform(-1.0, 1.0, zones)
    return Episode(noise, onset, np.isin(np.arange(1, sensors + 1), group), transition(config, beta), heat_w)


def _draw_whole(value: IntRange, generator: np.random.Generator) -> int:
    low, high = bounds(value)
    return int(generator.integers(int(low), int(high) + 1))


def start(state: State, b: int, episode: Episode, config: HvacConfig) -> None:
    """Put an episode at k = 0: every zone at the initial temperature, heating off, sums and windows empty."""
    for array in state:
        array[b] = 0
    state.noise[b] = episode.noise
    state.onset[b] = episode.onset
    state.compromised[b] = episode.compromised
    state.plant[b] = episode.plant
    state.heat[b] = episode.heat_w
    state.temperature[b] = config.initial_c
    state.covariance[b] = UNCERTAIN * np.eye(config.num_zones)
