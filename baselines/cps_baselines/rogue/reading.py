"""How kernels of policies read observations, what orders mean, and what a policy remembers between decisions."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import Record, clip, inlined
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray, IntArray, Observation, State
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


@inlined
def linear_effort(
    observation: Observation, scale: FloatArray, b: int, at: Record, gains: tuple[float, float], e: Record
) -> float:
    """The effort by which the linear law (5.15) drives environment `b`, within the limits; gains in 1/s2 and 1/s."""
    speed, ratio = read(observation, scale, b, at.speed), read(observation, scale, b, at.power_ratio)
    error = read(observation, scale, b, at.front_gap_error) - read(observation, scale, b, at.rear_gap_error)
    rate = read(observation, scale, b, at.front_gap_rate) - read(observation, scale, b, at.rear_gap_rate)
    wanted = gains[0] * error + gains[1] * rate + e.drag_per_s * speed
    return float(clip(wanted / (ratio * e.drive_mps2), e.min_effort, e.max_effort))


def levels_of(config: RogueConfig) -> FloatArray:
    """The accelerations (m/s2) that can be ordered beside controllers."""
    braking, driving = command_limits(config)
    return np.where(LEVELS < 0.0, LEVELS * braking, LEVELS * driving)


def commanded(orders: IntArray, config: RogueConfig) -> FloatArray:
    """The accelerations (B, n) in m/s2 that orders (B, 2 n) name, NaN where they name a controller."""
    level = orders[:, ::2] - len(CONTROLLERS)
    return np.where(level < 0, np.nan, levels_of(config)[np.maximum(level, 0)])


def since_onset(seen: Seen, state: State | None, duration_s: float) -> tuple[FloatArray, FloatArray]:
    """Seconds since the attack began, and when it began (B,); onsets are observed only until they have passed."""
    now_s = duration_s - seen["time_left_s"]
    onset_s = recalled(now_s + seen["until_onset_s"], seen, state)
    return now_s - onset_s, onset_s


def recalled(first: FloatArray, seen: Seen, state: State | None) -> FloatArray:
    """A fresh copy of the remembered array (B,), with `first` (B,) in the environments whose episode starts."""
    return first if state is None else np.where(seen.start, first, state[0])
