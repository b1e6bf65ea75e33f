"""The defender's action spaces, and the efforts behind the attacker's actions."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.config import bounds
from cps_envs.core.types import Array, FloatArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import CONTROLLERS

PLAIN, MODIFIED = 0, 1  # following with the separation kept, or with (5.12) to (5.14)


def mode_space(num_vehicles: int) -> spaces.MultiDiscrete:
    """Controller and modification of each vehicle, from the rear."""
    return spaces.MultiDiscrete([len(CONTROLLERS), 2] * num_vehicles)


def command_limits(config: RogueConfig) -> tuple[float, float]:
    """The accelerations (m/s2) of the actions -1 (as a positive number) and 1: full effort at v_ref, 7.5 and 2.5.

    Drawn quantities stand at the middle of their range.
    """
    ranges = (config.drive_mps2, config.drag_per_s, config.reference_speed_mps)
    drive, drag, speed = (sum(bounds(quantity)) / 2 for quantity in ranges)
    return drag * speed - drive * config.min_effort, drive * config.max_effort - drag * speed


def action_of_effort(effort: Array, speed_mps: Array, power_ratio: Array, config: RogueConfig) -> FloatArray:
    """The attacker's actions in [-1, 1] that set these efforts at these speeds; all arguments broadcast.

    The inverse of `dynamics.effort_of`, with drive and drag at the middle of their range where they are drawn.
    """
    drive, drag = (sum(bounds(quantity)) / 2 for quantity in (config.drive_mps2, config.drag_per_s))
    cruise = np.clip(drag * speed_mps / (power_ratio * drive), config.min_effort, config.max_effort)
    reach = np.where(effort > cruise, config.max_effort - cruise, cruise - config.min_effort)
    action: FloatArray = np.clip((effort - cruise) / np.maximum(reach, 1e-12), -1.0, 1.0)
    return action
