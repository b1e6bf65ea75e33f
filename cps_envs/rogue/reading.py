"""How kernels of adapters and policies read observations, and what the defender's orders mean."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import Record, inlined
from cps_envs.core.types import FloatArray, IntArray, Observation
from cps_envs.rogue.actions import LEVELS, command_limits
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import CONTROLLERS


@inlined
def read(observation: Observation, scale: FloatArray, b: int, entry: int) -> float:
    """An entry of environment `b` in its unit, as `Fields.decode` gives it."""
    return float(observation[b, entry] * scale[1, entry] + scale[0, entry])


@inlined
def vehicles(values: FloatArray, at: Record, longest: int) -> int:
    """How many vehicles an episode has, whose decoded observation is `values`; `longest` in the configuration."""
    absent = at.time_left_s - at.present
    for k in range(at.present, at.time_left_s):
        absent -= int(values[k] > 0.5)
    return int(longest - absent)


@inlined
def nearest(values: FloatArray, value: float) -> int:
    """The index of the nearest of some values."""
    best = 0
    for k in range(values.size):
        if abs(value - values[k]) < abs(value - values[best]):
            best = k
    return best


def levels_of(config: RogueConfig) -> FloatArray:
    """The accelerations (m/s2) that can be ordered beside controllers."""
    braking, driving = command_limits(config)
    return np.where(LEVELS < 0.0, LEVELS * braking, LEVELS * driving)


def commanded(orders: IntArray, config: RogueConfig) -> FloatArray:
    """The accelerations (B, n) in m/s2 that orders (B, 2 n) name, NaN where they name a controller."""
    level = orders[:, ::2] - len(CONTROLLERS)
    return np.where(level < 0, np.nan, levels_of(config)[np.maximum(level, 0)])
