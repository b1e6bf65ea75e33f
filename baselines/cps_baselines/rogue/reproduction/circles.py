"""Fig. 5.4: where the errors of a vehicle lie among the circles (5.13), and what the schedule (5.12) can do there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.rogue.reproduction.course import Course
from cps_envs.core.config import bounds
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.rogue.config import RogueConfig


class Errors(NamedTuple):
    """Of a vehicle that follows the attacker, T moments from its alarm until a human takes over."""

    vehicle: int  # index, from the rear
    position_m: FloatArray  # (T,) e, to the separation that has grown
    speed_mps: FloatArray  # (T,) d


def followers(course: Course) -> list[Errors]:
    """Those of the vehicles right behind and right ahead of the attacker, as far as their alarms blame it."""
    seat, found = course.attacker, []
    human = np.logical_or.accumulate(course.human.any(axis=1))
    for vehicle, pair, side in ((seat - 1, seat - 1, 1), (seat + 1, seat, -1)):
        following = (course.alarm[:, vehicle] == side) & ~human
        wanted = course.config.separation_m + course.growth_m[:, vehicle]
        position = side * (course.separation_m[:, pair] - wanted)
        speed = side * np.diff(course.speed_mps, axis=1)[:, pair]
        if following.any():
            found.append(Errors(vehicle, position[following], speed[following]))
    return found


def radii_m(config: RogueConfig) -> list[float]:
    """r_1 to r_4 of (5.13)."""
    shares = (config.inner_share, config.middle_share, config.outer_share, 1.0)
    return [share * config.separation_m for share in shares]


def shares_of_rings(errors: Errors, config: RogueConfig) -> FloatArray:
    """The shares of the time (5,) within r_1, between it and r_2, ..., and beyond r_4."""
    rings = np.searchsorted(radii_m(config), np.hypot(errors.position_m, errors.speed_mps), side="right")
    shares: FloatArray = np.bincount(rings, minlength=5) / len(rings)
    return shares


def affected(errors: Errors, config: RogueConfig) -> BoolArray:
    """Whether a_m makes a difference (T,) at the speed v_ref: only deep within the boundary layer.

    Elsewhere even the least command, a share of 2 k_1 v_max + n_3 a_max + epsilon, is more than the actuator gives.
    """
    surface = config.surface_slope_per_s * errors.position_m + errors.speed_mps
    share = np.clip(surface / config.boundary_layer_mps, -1.0, 1.0)
    base = 2 * config.surface_slope_per_s * config.max_speed_mps + config.boundary_layer_mps
    weakest, strongest = (share * (base + part * config.max_acceleration_mps2) for part in (config.inner_share, 1.0))
    speed = bounds(config.reference_speed_mps)[0]
    drive, drag = bounds(config.drive_mps2)[0], bounds(config.drag_per_s)[0]
    limits = drive * config.min_effort - drag * speed, drive * config.max_effort - drag * speed
    differs: BoolArray = np.clip(weakest, *limits) != np.clip(strongest, *limits)
    return differs
