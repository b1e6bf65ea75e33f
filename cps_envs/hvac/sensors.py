"""Sensors, the sets that feed the observer (4.31), and the order in which sensors fall to the attacker."""

from __future__ import annotations

from itertools import product

import numpy as np

from cps_envs.core.types import BoolArray, IntArray
from cps_envs.hvac.parameters import Parameters

SensorSet = tuple[int, ...]  # sensor numbers, from 1, ascending


def sensor_sets(config: Parameters) -> tuple[SensorSet, ...]:
    """The sets that the defender chooses from: those of `sensor_sets`, or by `set_size`, or all, in the paper's order.

    With `set_size`, as many sets as sensors: set i holds so many sensors in a row from sensor i on, the first after the
    last. One sensor short of all is "leave one out".

    All, with one sensor per zone: every subset but the empty and the full one, counted in binary with sensor 1 as the
    most significant bit; 14 with four sensors. Two per zone: each zone uses none, its first or its second sensor,
    without the sets that cover no zone or all zones; 64 with eight sensors, zone 1 varying slowest. Their number grows
    exponentially with the zones. In a building of one zone each sensor is a set.
    """
    if config.sensor_sets:
        return _separated(config.sensor_sets)
    if config.set_size:
        return _rows(config.num_sensors, config.set_size)
    zones = config.num_zones
    options = [[0, *range(zone, config.num_sensors + 1, zones)] for zone in range(1, zones + 1)]
    used = (tuple(sorted(sensor for sensor in choice if sensor)) for choice in product(*options))
    return tuple(sensors for sensors in used if 0 < len(sensors) < max(zones, 2))


def filter_sets(config: Parameters) -> tuple[SensorSet, ...]:
    """The sensors of each Kalman filter that the defender is offered: those of `sensor_sets`, then all, then none."""
    if not config.kalman_filters:
        return ()
    return (*sensor_sets(config), tuple(range(1, config.num_sensors + 1)), ())


def _rows(sensors: int, size: int) -> tuple[SensorSet, ...]:
    """For each sensor the set of `size` in a row that begins with it."""
    return tuple(tuple(sorted((first + place) % sensors + 1 for place in range(size))) for first in range(sensors))


def _separated(flat: tuple[int, ...]) -> tuple[SensorSet, ...]:
    """The sets of a list in which they are separated by zeros; an empty one stays empty."""
    sets: list[list[int]] = [[]]
    for sensor in flat:
        if sensor == 0:
            sets.append([])
        else:
            sets[-1].append(sensor)
    return tuple(tuple(sorted(sensors)) for sensors in sets)


def attack_order(config: Parameters) -> tuple[int, ...]:
    """Sensors in the order in which they fall: 2, 1, 4, 3, 6, 5, 8, 7 unless the configuration has another."""
    last = config.num_sensors
    swapped = (sensor + 1 if sensor % 2 else sensor - 1 for sensor in range(1, last + 1))
    return config.attack_order or tuple(min(sensor, last) for sensor in swapped)


def zones_of_sensors(config: Parameters) -> IntArray:
    """The zone (S,) of each sensor, counted from 0."""
    return np.arange(config.num_sensors) % config.num_zones


def membership(config: Parameters, sets: tuple[SensorSet, ...] | None = None) -> BoolArray:
    """Which sensors each set uses, (sets, S); without `sets`, those of `sensor_sets`."""
    sets = sensor_sets(config) if sets is None else sets
    member = np.zeros((len(sets), config.num_sensors), np.bool_)
    for row, sensors in zip(member, sets, strict=True):
        row[np.array(sensors, np.int64) - 1] = True
    return member


def sensors_of_choices(config: Parameters) -> BoolArray:
    """Which sensors each choice of the defender uses, (C, S): all for the raw readings, none for the model.

    Thermostats, if there are any, come last and use all.
    """
    ends = np.ones((1, config.num_sensors), np.bool_)
    filters, last = membership(config, filter_sets(config)), ends[: int(config.thermostats)]
    return np.concatenate([ends, membership(config), ~ends, filters, last])


def sensor_names(config: Parameters) -> tuple[str, ...]:
    """The agents of a team with one for each sensor: sensor_1 to sensor_S."""
    return tuple(f"sensor_{number}" for number in range(1, config.num_sensors + 1))
