"""The defender's action spaces, and the efforts behind the attacker's actions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import clip, inlined, kernel, pack, unpack
from cps_envs.core.declare.config import bounds
from cps_envs.core.types import Array, FloatArray, IntArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import COMMANDED, CONTROLLERS

PLAIN, MODIFIED = 0, 1  # following with the separation kept, or with (5.12) to (5.14)
LEVELS = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # shares of the `command_limits` that "either" offers


def choices_of(config: RogueConfig) -> int:
    """How many controllers and levels a vehicle chooses from, controllers first; 0 where it is commanded."""
    return {"mode": len(CONTROLLERS), "either": len(CONTROLLERS) + len(LEVELS), "command": 0}[config.defense_action]


def order_space(config: RogueConfig, num_vehicles: int) -> spaces.Space[Any]:
    """What vehicles are ordered, from the rear: choice and modification of each, or an acceleration."""
    choices = choices_of(config)
    if choices == 0:
        return spaces.Box(-1.0, 1.0, (num_vehicles,), np.float32)
    return spaces.MultiDiscrete([choices, 2] * num_vehicles)


class Engine(NamedTuple):
    """Drive, drag and efforts of an intact vehicle; drawn quantities stand at the middle of their range."""

    drive_mps2: float
    drag_per_s: float
    min_effort: float
    max_effort: float


def engine_of(config: RogueConfig) -> Engine:
    """The engine under a configuration."""
    drive, drag = (sum(bounds(quantity)) / 2 for quantity in (config.drive_mps2, config.drag_per_s))
    return Engine(drive, drag, config.min_effort, config.max_effort)


def command_limits(config: RogueConfig) -> tuple[float, float]:
    """The accelerations (m/s2) of the actions -1 (as a positive number) and 1: full effort at v_ref, 7.5 and 2.5."""
    engine, speed = engine_of(config), sum(bounds(config.reference_speed_mps)) / 2
    braking = engine.drag_per_s * speed - engine.drive_mps2 * engine.min_effort
    return braking, engine.drive_mps2 * engine.max_effort - engine.drag_per_s * speed


@kernel
def read_choices(action: IntArray, limits: tuple[float, float], orders: IntArray, accelerations: FloatArray) -> None:
    """Write which controllers, whether modified (B, k, 2), and accelerations (B, k) are ordered by choices (B, 2 k)."""
    for b in range(accelerations.shape[0]):
        for k in range(accelerations.shape[1]):
            choice = action[b, 2 * k]
            level = LEVELS[max(choice - COMMANDED, 0)]
            orders[b, k, 0], orders[b, k, 1] = min(choice, COMMANDED), action[b, 2 * k + 1]
            accelerations[b, k] = acceleration_of(level, limits)


@kernel
def read_levels(action: FloatArray, limits: tuple[float, float], accelerations: FloatArray) -> None:
    """Write the accelerations (B, k) in m/s2 of actions (B, k) in [-1, 1]."""
    for b in range(accelerations.shape[0]):
        for k in range(accelerations.shape[1]):
            accelerations[b, k] = acceleration_of(action[b, k], limits)


@inlined
def acceleration_of(level: float, limits: tuple[float, float]) -> float:
    """The acceleration (m/s2) of a level in [-1, 1], see `command_limits`."""
    return level * (limits[0] if level < 0.0 else limits[1])


def action_of_effort(effort: Array, speed_mps: Array, power_ratio: Array, config: RogueConfig) -> FloatArray:
    """The attacker's actions in [-1, 1] that set these efforts at these speeds; all arguments broadcast.

    The inverse of `dynamics.effort_of`.
    """
    given = np.stack(np.broadcast_arrays(effort, speed_mps, power_ratio)).astype(np.float64)
    actions = np.empty(given.shape[1:])
    _set_efforts(given.reshape(3, -1), pack(engine_of(config)), actions.reshape(-1))
    return actions


@kernel
def _set_efforts(given: FloatArray, engine: Array, actions: FloatArray) -> None:
    effort, speed, ratio = given
    for k in range(actions.size):
        actions[k] = action_for(effort[k], speed[k], ratio[k], unpack(Engine, engine, 0))


@inlined
def action_for(effort: float, speed_mps: float, power_ratio: float, engine: Engine) -> float:
    """`action_of_effort` of one vehicle, for kernels."""
    least, most = engine.min_effort, engine.max_effort
    cruise = clip(engine.drag_per_s * speed_mps / (power_ratio * engine.drive_mps2), least, most)
    reach = most - cruise if effort > cruise else cruise - least
    return clip((effort - cruise) / max(reach, 1e-12), -1.0, 1.0)
