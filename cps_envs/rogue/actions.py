"""The defender's action spaces, and the efforts behind the attacker's actions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import clip, inlined, kernel, records, unpack
from cps_envs.core.declare.bodies import spans
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


class Body(NamedTuple):
    """What an intact vehicle is; drawn quantities stand at the middle of their range."""

    drive_mps2: float
    drag_per_s: float
    length_m: float
    proportional_gain: float
    derivative_gain: float
    min_effort: float
    max_effort: float


def bodies_of(config: RogueConfig) -> Array:
    """The vehicles from the rear under a configuration, records (n,) of `Body`, or (1,) where all are alike."""
    table = records(Body, config.num_bodies)
    for name in Body._fields:
        value = getattr(config, "vehicle_length_m" if name == "length_m" else name)
        table[name] = spans(value).mean(axis=0)
    return table


@inlined
def body_of(bodies: Array, i: int) -> Body:
    """Vehicle `i` of `bodies_of`, 0 = rear."""
    return unpack(Body, bodies, min(i, bodies.size - 1))


def command_limits(config: RogueConfig) -> tuple[float, float]:
    """The accelerations (m/s2) of the actions -1 (as a positive number) and 1: full effort at v_ref, 7.5 and 2.5.

    Where vehicles differ, of the strongest, so that every one of them can be driven in full.
    """
    bodies, speed = bodies_of(config), sum(config.reference_range_mps) / 2
    drag, drive = bodies["drag_per_s"] * speed, bodies["drive_mps2"]
    return float((drag - drive * config.min_effort).max()), float((drive * config.max_effort - drag).max())


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


def action_of_effort(
    effort: Array, speed_mps: Array, power_ratio: Array, config: RogueConfig, attacker_index: Array | int = 1
) -> FloatArray:
    """The attacker's actions in [-1, 1] that set these efforts at these speeds; all arguments broadcast.

    `attacker_index` (1 = rear) matters where vehicles differ. The inverse of `dynamics.effort_of`.
    """
    given = np.stack(np.broadcast_arrays(effort, speed_mps, power_ratio, attacker_index)).astype(np.float64)
    actions = np.empty(given.shape[1:])
    _set_efforts(given.reshape(4, -1), bodies_of(config), actions.reshape(-1))
    return actions


@kernel
def _set_efforts(given: FloatArray, bodies: Array, actions: FloatArray) -> None:
    effort, speed, ratio, place = given
    for k in range(actions.size):
        actions[k] = action_for(effort[k], speed[k], ratio[k], body_of(bodies, int(place[k]) - 1))


@inlined
def action_for(effort: float, speed_mps: float, power_ratio: float, body: Body) -> float:
    """`action_of_effort` of one vehicle, for kernels."""
    least, most = body.min_effort, body.max_effort
    cruise = clip(body.drag_per_s * speed_mps / (power_ratio * body.drive_mps2), least, most)
    reach = most - cruise if effort > cruise else cruise - least
    return clip((effort - cruise) / max(reach, 1e-12), -1.0, 1.0)
