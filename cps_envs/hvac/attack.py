"""Attacks on readings, commands and set-points: what an action of the attacker means, and how to write one in units."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import clip, inlined
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array, FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.powers import ABSENT, powers_of
from cps_envs.hvac.state import State, on_the_spot

NOISE_FREE, OWN, ABSOLUTE = -1.0, 0.0, 1.0  # what forged readings are based on, as an entry of an action
EDGE = 1.0 / 3.0  # beyond which an entry between them counts as the outer one, and messages are denied


@inlined
def sense(model: Model, rules: Rules, episode: State, action: FloatArray) -> None:
    """Read the sensors of k = step. From the onset on, forge readings of compromised ones, or let none arrive.

    `action` is (entries,), see `Powers`; an entry of 1 is half the sensor range. Of readings that are denied, the last
    that arrived stay.
    """
    k = episode.step[0]
    base = action[rules.base] if rules.base >= 0 else OWN
    own = -EDGE <= base <= EDGE
    episode.denied[0] = is_denied(episode, action, rules.deny_readings_at)
    for s in range(len(episode.measured)):
        low, high = model.sensor_low_c[s], model.sensor_high_c[s]
        middle, reach = 0.5 * (high + low), 0.5 * (high - low)
        true = episode.temperature[model.zone[s]]
        episode.measured[s] = true + model.noise_c[s] * episode.series[k, s]
        if episode.denied[0]:
            continue
        episode.reading[s] = episode.measured[s]
        if episode.compromised[s] and k >= episode.onset[0] and not (own and action[s] == 0.0):
            origin = episode.measured[s] if own else (true if base < 0.0 else middle)
            episode.reading[s] = clip(origin + reach * action[s], low, high)


@inlined
def is_denied(episode: State, action: FloatArray, at: int) -> bool:
    """Whether an action keeps messages from arriving, by its entry `at`; -1: it has none."""
    return bool(at >= 0 and episode.step[0] >= episode.onset[0] and action[at] > EDGE)


@inlined
def shift_references(model: Model, rules: Rules, episode: State, action: FloatArray) -> None:
    """Move the set-points of k = step, from the onset on; those that thermostats have on the spot stay."""
    moved = rules.references_at >= 0 and episode.step[0] >= episode.onset[0] and not on_the_spot(rules, episode)
    for i in range(len(episode.shift)):
        episode.shift[i] = model.reference_attack_c[i] * action[rules.references_at + i] if moved else 0.0


@inlined
def deliver(model: Model, rules: Rules, episode: State, action: FloatArray) -> None:
    """Let the commands of k = step reach the zones, from the onset on with what the attacker adds, or not at all.

    Without commands a zone goes on with what it got last. Thermostats on the spot hear no commands.
    """
    local = on_the_spot(rules, episode)
    adds = rules.commands_at >= 0 and episode.step[0] >= episode.onset[0] and not local
    episode.denied[1] = is_denied(episode, action, rules.deny_commands_at) and not local
    for i in range(len(episode.heating)):
        if episode.denied[1]:
            continue
        episode.supplied[i] = episode.heating[i]
        if adds:
            added = episode.heating[i] + model.command_attack_w[i] * action[rules.commands_at + i]
            episode.supplied[i] = clip(added, model.least_w[i], model.most_w[i])


def absolute_action(config: HvacConfig, reading_c: Array) -> FloatArray:
    """The action (B, entries) that makes compromised sensors show `reading_c` (B, S) or (B, 1), C, without any noise.

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
    """The action (B, entries) that makes compromised sensors read `bias_c` (B, S) or (B, 1), C, too cold.

    The bias is taken from the sensor's own reading (`keep_noise`), or from
    the true temperature of its zone.

    Raises:
        ConfigurationError: a bias without noise where the configuration's attacker only adds to its own readings.
    """
    shares = bias_c / (-0.5 * (np.asarray(config.sensor_high_c) - np.asarray(config.sensor_low_c)))
    shares = np.minimum(np.maximum(shares, -1.0), 1.0)  # np.clip takes several times as long on small arrays
    return _based(config, shares, OWN if keep_noise else NOISE_FREE)


def with_powers(config: HvacConfig, action: FloatArray, **shares: FloatArray | float) -> FloatArray:
    """An action (B, entries), changed so that it also does more than forge readings.

    `commands` and `references` (B, n), from -1 to 1, are shares of what `command_attack_w` and `reference_attack_c`
    allow. `deny_readings` and `deny_commands` (B, 1) are 1 where no such messages may arrive.

    Raises:
        ConfigurationError: a power that the configuration does not give.
    """
    powers = powers_of(config)
    for name, (at, size, field) in {
        "commands": (powers.commands_at, config.num_zones, "command_attack_w"),
        "references": (powers.references_at, config.num_zones, "reference_attack_c"),
        "deny_readings": (powers.deny_readings_at, 1, "denial"),
        "deny_commands": (powers.deny_commands_at, 1, "denial"),
    }.items():
        if name in shares:
            if at == ABSENT:
                raise ConfigurationError(f"the attacker has no power over {name} here: set {field}.")
            action[:, at : at + size] = shares[name]
    return action


def _based(config: HvacConfig, shares: FloatArray, base: float) -> FloatArray:
    replaces = config.attack_action == "any"
    if base != OWN and not replaces:
        raise ConfigurationError('this attack replaces readings; it needs attack_action="any".')
    powers = powers_of(config)
    action = np.zeros((len(shares), powers.entries))
    action[:, : config.num_sensors] = shares
    if replaces:
        action[:, powers.base] = base
    return action
