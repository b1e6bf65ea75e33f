"""Forged readings: what an attacker's action means, and how to write one in units."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import clip, inlined
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array, FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.state import State

NOISE_FREE, OWN, ABSOLUTE = -1.0, 0.0, 1.0  # what forged readings are based on, as the last entry of an action
EDGE = 1.0 / 3.0  # beyond which an entry between them counts as the outer one


@inlined
def sense(model: Model, rules: Rules, episode: State, action: FloatArray) -> None:
    """Read the sensors of k = step, and forge the readings of compromised ones from the onset on.

    `action` is (S + 1,), or (S,) where only biases are possible; an entry of 1 is half the sensor range.
    """
    k = episode.step[0]
    base = action[-1] if rules.any_base else OWN
    own = -EDGE <= base <= EDGE
    for s in range(len(model.zone)):
        low, high = model.sensor_low_c[s], model.sensor_high_c[s]
        middle, reach = 0.5 * (high + low), 0.5 * (high - low)
        true = episode.temperature[model.zone[s]]
        episode.measured[s] = true + model.noise_c[s] * episode.series[k, s]
        episode.reading[s] = episode.measured[s]
        if episode.compromised[s] and k >= episode.onset[0] and not (own and action[s] == 0.0):
            origin = episode.measured[s] if own else (true if base < 0.0 else middle)
            episode.reading[s] = clip(origin + reach * action[s], low, high)


def absolute_action(config: HvacConfig, reading_c: Array) -> FloatArray:
    """The action (B, S + 1) that makes compromised sensors show `reading_c` (B, S) or (B, 1), C, without any noise.

    Raises:
        ConfigurationError: a reading outside the sensor range, or a configuration whose attacker only adds biases.
    """
    low, high = np.asarray(config.sensor_low_c), np.asarray(config.sensor_high_c)
    if not ((reading_c >= low) & (reading_c <= high)).all():
        raise ConfigurationError(
            f"a forged reading lies outside the sensor range [{low.max()}, {high.min()}] C: clip it, or widen "
            "sensor_low_c and sensor_high_c."
        )
    return _based(config, (reading_c - 0.5 * (high + low)) / (0.5 * (high - low)), ABSOLUTE)


def bias_action(config: HvacConfig, bias_c: Array, *, keep_noise: bool = False) -> FloatArray:
    """The action (B, S + 1) that makes compromised sensors read `bias_c` (B, S) or (B, 1), C, too cold.

    It is (B, S) where `attack_action="bias"`. The bias is taken from the sensor's own reading (`keep_noise`), or from
    the true temperature of its zone.

    Raises:
        ConfigurationError: a bias without noise where the configuration's attacker only adds to its own readings.
    """
    shares = bias_c / (-0.5 * (np.asarray(config.sensor_high_c) - np.asarray(config.sensor_low_c)))
    shares = np.minimum(np.maximum(shares, -1.0), 1.0)  # np.clip takes several times as long on small arrays
    return _based(config, shares, OWN if keep_noise else NOISE_FREE)


def _based(config: HvacConfig, shares: FloatArray, base: float) -> FloatArray:
    replaces = config.attack_action == "any"
    if base != OWN and not replaces:
        raise ConfigurationError('this attack replaces readings; it needs attack_action="any".')
    action = np.full((len(shares), config.num_sensors + replaces), base)
    action[:, : config.num_sensors] = shares
    return action
