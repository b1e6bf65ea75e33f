"""The configuration of the HVAC problem: what it has to satisfy, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cps_envs.core.declare.config import bounds, check_bodies, extremes, of_bodies, validate
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.building import conductances, places_of
from cps_envs.hvac.parameters import MAX_ZONES, Parameters
from cps_envs.hvac.sensors import attack_order, sensor_sets
from cps_envs.hvac.weather_files import shipped_weather

MAX_SETS = 256


@dataclass(frozen=True)
class HvacConfig(Parameters):
    """A building of n zones, its temperature sensors, the controller that heats it, and what the two roles may do.

    Zones and sensors are numbered from 1. Sensor s sits in zone ((s - 1) mod n) + 1. Replace the building by giving
    one heat capacity and one wall resistance per zone, and the links between zones with one resistance each. A field
    marked as ranged takes a number, or a pair (low, high) from which every reset draws uniformly.

    Raises:
        ConfigurationError: a value of wrong type, out of bounds, or that does not fit the others.
    """

    def __post_init__(self) -> None:
        validate(self)
        _check_building(self)
        check_bodies(self, {"zone": self.num_zones, "sensor": self.num_sensors})
        _check_sensors(self)
        _check_attack(self)
        _check_clock(self)
        places_of(self)


def _check_building(config: Parameters) -> None:
    """Raise ConfigurationError for lists that do not fit together, impossible links, or a step that is unstable."""
    zones, links = config.num_zones, config.link_zones
    _require(1 <= zones <= MAX_ZONES, f"heat_capacity_j_per_k has {zones} zones; give 1 to {MAX_ZONES} values.")
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


def _check_step(config: Parameters) -> None:
    """The forward difference (4.5) keeps temperatures between those around them only below this step."""
    longest = 1.0 / float(np.abs(np.diag(conductances(config))).max())
    _require(
        config.step_s <= longest,
        f"step_s = {config.step_s}: the forward difference (4.5) is stable up to {longest:.4g} s in this building. "
        "Choose a shorter step_s, larger heat_capacity_j_per_k or larger resistances.",
    )


def _check_sensors(config: Parameters) -> None:
    """Raise ConfigurationError for a number or a range of sensors, or for sets of them, that cannot be."""
    zones, sensors = config.num_zones, config.num_sensors
    _require(
        sensors in (zones, 2 * zones),
        f"num_sensors = {sensors}: a zone has one or two sensors; choose {zones} or {2 * zones}.",
    )
    lows, highs = of_bodies(config.sensor_low_c, sensors), of_bodies(config.sensor_high_c, sensors)
    _require(
        bool((lows < highs).all()),
        f"sensor_low_c = {config.sensor_low_c} must lie below sensor_high_c = {config.sensor_high_c}.",
    )
    low, high = float(lows.max()), float(highs.min())
    for name in ("reference_c", "initial_c"):
        value = getattr(config, name)
        least, most = extremes(value)
        _require(
            low <= least and most <= high,
            f"{name} = {value} lies outside the sensor range [{low}, {high}]; widen sensor_low_c, sensor_high_c.",
        )
    for name in ("outdoor_c", "ground_c"):
        value = getattr(config, name)
        wide = value.width if isinstance(value, Series) else 1
        _require(wide == 1, f"{name} has {wide} values at a time; all zones have the same.")
    counts = len(config.thresholds_c2)
    _require(counts == 2, f"thresholds_c2 has {counts} values; give one for one sensor per zone and one for two.")
    _check_sets(config)


def _check_sets(config: Parameters) -> None:
    sensors, zones = config.num_sensors, config.num_zones
    remedy = f"give numbers from 1 to {sensors}, each once in a set, with a single 0 between two sets."
    count = (sensors // zones + 1) ** zones  # of the sets in (4.31), about
    named = bool(config.sensor_sets or config.set_size)
    _require(named or count <= 2 * MAX_SETS, _too_many(count))
    _require(
        not (config.sensor_sets and config.set_size),
        "sensor_sets and set_size are two ways to name the sets: leave one of them out.",
    )
    _require(
        config.set_size < sensors,
        f"set_size = {config.set_size}: a set leaves some of the {sensors} sensors out; choose at most {sensors - 1}.",
    )
    sets = sensor_sets(config)
    for chosen in sets:
        proper = 0 < len(chosen) == len(set(chosen)) and max(chosen) <= sensors
        _require(proper, f"sensor_sets has the set {chosen}, which cannot be; {remedy}")
    _require(len(set(sets)) == len(sets), f"sensor_sets = {config.sensor_sets} has a set twice; {remedy}")
    _require(min(2, sensors) <= len(sets) <= MAX_SETS, _too_many(len(sets)))


def _too_many(count: int) -> str:
    return (
        f"there are {count} sensor sets; name 2 to {MAX_SETS} of them in sensor_sets, with a 0 between two sets, or "
        "give the sensors of a set in set_size, which makes one set per sensor."
    )


def _check_attack(config: Parameters) -> None:
    """Raise ConfigurationError for sensors that cannot be compromised."""
    sensors, order = config.num_sensors, attack_order(config)
    _require(
        max(order) <= sensors and len(set(order)) == len(order),
        f"attack_order = {order}: name each sensor once, by its number from 1 to {sensors}.",
    )
    weights = config.compromised_weights
    _require(
        not weights or (sum(weights) > 0 and len(weights) <= len(order) + 1),
        f"compromised_weights = {weights}: give at most {len(order) + 1} weights, for 0 to {len(order)} sensors, at "
        "least one of them above 0.",
    )
    _require(
        config.max_compromised <= len(order),
        f"num_compromised = {config.num_compromised} exceeds the {len(order)} sensors that can fall; lower it, or name "
        "more sensors in attack_order.",
    )


def _check_clock(config: Parameters) -> None:
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


PAPER = HvacConfig()
EASY = replace(
    PAPER,
    onset_step=(100, 400),
    num_compromised=(1, 3),
    random_compromise=True,
    model_error=0.02,
    unmeasured_heat_w=50.0,
)
LEARNING = replace(
    EASY,
    ground_c=14.0,
    outdoor_mean_c=10.0,
    outdoor_swing_c=6.0,
    onset_step=(200, 480),
    compromised_weights=(0.2, 0.3, 0.3, 0.2),
    heat_drift_w=(50.0, 150.0),
    forecast_bias_c=(1.0, 1.5),
    forecast_drift_c=(1.0, 1.5),
    kalman_filters=True,
    attacker_sees_choice=False,
)
HARD = replace(LEARNING, heat_drift_w=150.0, filter_heat_w=150.0)
WEATHER = replace(LEARNING, outdoor_c=shipped_weather(), ground_c=5.0)  # a day of a year of hours, in blocks of a week
PRESETS = {"paper": PAPER, "easy": EASY, "learning": LEARNING, "hard": HARD, "weather": WEATHER}

HOUSE = (
    *("heat_capacity_j_per_k", "wall_resistance_k_per_w", "link_zones", "link_resistance_k_per_w", "ground_zones"),
)
SYSTEM = (*HOUSE, "step_s", "noise_std_c")  # what numbers of policies were found for
SIZES = (  # what the lengths of arrays follow, beside the zones and their links
    *("num_steps", "window_steps", "prediction_steps", "controller", "num_levels", "num_sensors", "set_size"),
    *("kalman_filters", "thermostats", "attacker_view", "attacker_sees_choice"),
)


def has_preset_sizes(config: HvacConfig) -> bool:
    """Whether arrays are as long as in some preset, for whose lengths kernels are compiled."""
    return any(_sizes(config) == _sizes(preset) for preset in PRESETS.values())


def _sizes(config: HvacConfig) -> tuple[object, ...]:
    drifts = (
        extremes(config.heat_drift_w)[1],
        extremes(config.forecast_bias_c)[1],
        extremes(config.forecast_drift_c)[1],
    )
    present = tuple(most > 0 for most in drifts)  # without them there is no room for their courses
    alike = isinstance(config.reference_c, (int, float))  # all zones have one set-point
    return config.num_zones, len(config.link_zones), alike, *present, *(getattr(config, name) for name in SIZES)
