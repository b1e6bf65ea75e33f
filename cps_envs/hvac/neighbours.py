"""What a sensor is compared with: the filters of all sensors, of none, of few with it, and of many without it."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.sensors import filter_sets, membership, sensor_sets


class Neighbours:
    """Indices of sets, which are also those of the Kalman filters, for each of S sensors.

    Raises:
        ConfigurationError: a configuration without filters, or with a sensor that is in no set or in all of them.
    """

    def __init__(self, config: HvacConfig) -> None:
        if config.num_sensors == 1:
            raise ConfigurationError(
                "a single sensor cannot be compared with others, as learners do: give the zone a second one with "
                'num_sensors=2, or say interface="native".'
            )
        member = membership(config)  # (sets, S)
        if not config.kalman_filters or not (member.any(axis=0) & ~member.all(axis=0)).all():
            raise ConfigurationError(
                "this adapter compares filters with and without each sensor: set kalman_filters=true, and name sets in "
                "sensor_sets so that each sensor is in one of them and left out by another."
            )
        size = member.sum(axis=1)[:, np.newaxis]
        self.own: IntArray = np.arange(config.num_sensors)  # (S,)
        self.alone: IntArray = np.where(member, -size, -np.inf).argmax(axis=0)  # (S,) the smallest set with the sensor
        self.without: IntArray = np.where(member, -1, size).argmax(axis=0)  # (S,) the largest one without it
        self.everybody = len(sensor_sets(config))  # the filter of all sensors
        self.nobody = self.everybody + 1  # the filter of none
        self.member: BoolArray = membership(config, filter_sets(config))  # (F, S)


def of_others(values: FloatArray, weights: FloatArray) -> FloatArray:
    """For each sensor the mean of values (B, S) over all other sensors, by their weights (B, S); 0 without others."""
    weighted = values * weights
    sums = weighted.sum(axis=1, keepdims=True) - weighted
    counts = weights.sum(axis=1, keepdims=True) - weights
    mean: FloatArray = sums / np.maximum(counts, 1.0)
    return mean
