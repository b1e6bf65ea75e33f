"""What a configuration has to satisfy beyond the bounds of its single fields; every error names the remedy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cps_envs.core.config import bounds
from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.building import conductances
from cps_envs.hvac.sensors import attack_order, sensor_sets

if TYPE_CHECKING:
    from cps_envs.hvac.config import HvacConfig

MAX_ZONES = 16
MAX_SETS = 256


def check_building(config: HvacConfig) -> None:
    """Raise ConfigurationError for lists that do not fit together, impossible links, or a step that is unstable."""
    zones, links = config.num_zones, config.link_zones
    _require(2 <= zones <= MAX_ZONES, f"heat_capacity_j_per_k has {zones} zones; give 2 to {MAX_ZONES} values.")
    walls = len(config.wall_resistance_k_per_w)
    _require(walls == zones, f"wall_resistance_k_per_w has {walls} values for {zones} zones; give one per zone.")
    _require(len(links) % 2 == 0, f"link_zones = {links} has an odd length; give pairs of zones, as in (1, 2, 1, 3).")
    resistances = len(config.link_resistance_k_per_w)
    _require(
        resistances == len(links) // 2,
        f"link_resistance_k_per_w has {resistances} values for {len(links) // 2} links: give one per link.",
    )
    pairs = [tuple(sorted(pair)) for pair in zip(links[::2], links[1::2], strict=True)]
    for name, numbers in (("link_zones", links), ("ground_zones", config.ground_zones)):
        _require(max(numbers, default=1) <= zones, f"{name} = {numbers}: zones are numbered from 1 to {zones}.")
    _require(
        len(set(pairs)) == len(pairs) and all(one != two for one, two in pairs),
        f"link_zones = {links}: each link joins two different zones and is given once.",
    )
    _check_step(config)


def _check_step(config: HvacConfig) -> None:
    """The forward difference (4.5) keeps temperatures between those around them only below this step."""
    longest = 1.0 / float(np.abs(np.diag(conductances(config))).max())
    _require(
        config.step_s <= longest,
        f"step_s = {config.step_s}: the forward difference (4.5) is stable up to {longest:.4g} s in this building. "
        "Choose a shorter step_s, larger heat_capacity_j_per_k or larger resistances.",
    )


def check_sensors(config: HvacConfig) -> None:
    """Raise ConfigurationError for a number or a range of sensors, or for sets of them, that cannot be."""
    zones, sensors = config.num_zones, config.num_sensors
    _require(
        sensors in (zones, 2 * zones),
        f"num_sensors = {sensors}: a zone has one or two sensors; choose {zones} or {2 * zones}.",
    )
    low, high = config.sensor_low_c, config.sensor_high_c
    _require(low < high, f"sensor_low_c = {low} must lie below sensor_high_c = {high}.")
    for name in ("reference_c", "initial_c"):
        value = getattr(config, name)
        _require(
            low <= value <= high,
            f"{name} = {value} lies outside the sensor range [{low}, {high}]; widen sensor_low_c, sensor_high_c.",
        )
    counts = len(config.thresholds_c2)
    _require(counts == 2, f"thresholds_c2 has {counts} values; give one for one sensor per zone and one for two.")
    _check_sets(config)


def _check_sets(config: HvacConfig) -> None:
    sensors, zones = config.num_sensors, config.num_zones
    remedy = f"give numbers from 1 to {sensors}, each once in a set, with a single 0 between two sets."
    count = (sensors // zones + 1) ** zones  # of the sets in (4.31), about
    _require(bool(config.sensor_sets) or count <= 2 * MAX_SETS, _too_many(count))
    sets = sensor_sets(config)
    for chosen in sets:
        proper = 0 < len(chosen) == len(set(chosen)) and max(chosen) <= sensors
        _require(proper, f"sensor_sets has the set {chosen}, which cannot be; {remedy}")
    _require(len(set(sets)) == len(sets), f"sensor_sets = {config.sensor_sets} has a set twice; {remedy}")
    _require(2 <= len(sets) <= MAX_SETS, _too_many(len(sets)))


def _too_many(count: int) -> str:
    return f"there are {count} sensor sets; name 2 to {MAX_SETS} of them in sensor_sets, with a 0 between two sets."


def check_attack(config: HvacConfig) -> None:
    """Raise ConfigurationError for sensors that cannot be compromised."""
    sensors, order = config.num_sensors, attack_order(config)
    _require(
        max(order) <= sensors and len(set(order)) == len(order),
        f"attack_order = {order}: name each sensor once, by its number from 1 to {sensors}.",
    )
    _require(
        config.max_compromised <= len(order),
        f"num_compromised = {config.num_compromised} exceeds the {len(order)} sensors that can fall; lower it, or name "
        "more sensors in attack_order.",
    )


def check_clock(config: HvacConfig) -> None:
    """Raise ConfigurationError for an onset or a window that an episode is too short for."""
    steps, latest = config.num_steps, bounds(config.onset_step)[1]
    _require(
        latest < steps,
        f"onset_step = {config.onset_step} comes after the last state {steps - 1}; lower it or raise num_steps.",
    )
    _require(
        config.num_zones <= config.window_steps < steps,
        f"window_steps = {config.window_steps} must lie in [zones, num_steps) = [{config.num_zones}, {steps}).",
    )


def _require(holds: bool, message: str) -> None:
    if not holds:
        raise ConfigurationError(message)
