"""What the controller was given in the last step, in words and by sensor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.types import BoolArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.picture.scene import Scene
from cps_envs.hvac.sensors import filter_sets, membership, sensors_of_choices

MOST_NAMED = 16  # sensors


class EstimateSource(NamedTuple):
    """Where the estimate came from."""

    source: str
    believed: BoolArray  # (S,) sensors behind it
    flawed: bool  # one of them is compromised, and the attack has begun


def belief_of(scene: Scene) -> EstimateSource:
    """The choice of one step ago."""
    config, member, decided = scene.config, scene.member, scene.step - 1
    everything, nothing = np.ones(config.num_sensors, np.bool_), np.zeros(config.num_sensors, np.bool_)
    if decided < 0:
        return EstimateSource("Nothing decided yet", nothing, False)
    if config.thermostats and scene.choice == len(sensors_of_choices(config)) - 1:
        believed, source = everything, "Thermostats follow the raw readings"
    elif 0 < scene.choice <= len(member):
        believed = member[scene.choice - 1]
        source = f"Controller follows set {scene.choice}: {in_words(believed)}"
    elif scene.choice > len(member) + 1:
        believed = membership(config, filter_sets(config))[scene.choice - len(member) - 2]
        used = in_words(believed) if believed.any() else "no sensor"
        source = f"Controller follows the Kalman filter of {used}"
    elif scene.choice == 0:
        believed, source = everything, "Controller follows the raw readings"
    elif decided < config.window_steps:
        believed, source = everything, "Controller follows the least squares of all sensors"
    else:
        believed, source = nothing, "Controller follows the model alone"
    return EstimateSource(source, believed, bool((believed & scene.compromised).any()) and decided >= scene.onset)


def in_words(sensors: BoolArray) -> str:
    """The numbers of the marked sensors (S,), or how many they are."""
    numbers = [str(sensor + 1) for sensor in np.flatnonzero(sensors)]
    if len(numbers) > MOST_NAMED:
        return f"{len(numbers)} of {len(sensors)} sensors"
    return f"sensor {numbers[0]}" if len(numbers) == 1 else f"sensors {', '.join(numbers[:-1])} and {numbers[-1]}"


def clock(step: float, config: HvacConfig) -> str:
    """Time of a step since midnight of the first day, such as 6:40."""
    minutes = round(step * config.step_s / 60.0)
    return f"{minutes // 60}:{minutes % 60:02d}"
