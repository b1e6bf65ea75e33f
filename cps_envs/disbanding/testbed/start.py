"""The steady state in which the robots start, and what is drawn for an episode."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.types import Array
from cps_envs.disbanding.episode import draw_parameters
from cps_envs.disbanding.testbed.config import RobotConfig
from cps_envs.disbanding.testbed.kalman import INITIAL_VARIANCE
from cps_envs.disbanding.testbed.robot import wheel_target
from cps_envs.disbanding.testbed.rules import rules_of
from cps_envs.disbanding.testbed.state import Robots


def draw_episode(robots: Robots, b: int, config: RobotConfig, generator: np.random.Generator) -> None:
    """Draw the errors of an episode's wheels and all the noise of its episode."""
    shape = robots.gains[b].shape
    robots.gains[b] = 1.0 + config.wheel_gain_spread * generator.standard_normal(shape)
    generator.standard_normal(out=robots.noise[b])


def string_parameters(config: RobotConfig) -> Array:
    """The record of `disbanding.parameters.PARAMETERS` of the string: a step is a control period."""
    record = draw_parameters(config.road, np.random.default_rng(0))  # the road leaves nothing to chance
    record["dt_s"] = config.control_period_s
    record["saturate_command"] = True
    return record


def place_robots(robots: Robots, b: int, config: RobotConfig, arcs_m: NDArray[np.float64]) -> None:
    """Put an episode's robots on the circle at `arcs_m` (M,), all at the desired speed, and tell the filters."""
    radius, speed = config.radius_m, config.desired_speed_mps
    turning, rules, angle = speed / radius, rules_of(config), arcs_m / radius
    targets = np.array([wheel_target(speed, turning, side, rules) for side in (-1.0, 1.0)])
    for array in (robots.integral, robots.error, robots.speeds, robots.arcs):
        array[b] = 0.0
    robots.pose[b] = np.stack([radius * np.cos(angle), radius * np.sin(angle), angle + math.pi / 2], axis=1)
    robots.arc[b] = arcs_m
    robots.wheels[b] = targets * robots.gains[b]
    robots.speed[b] = config.wheel_radius_m * robots.wheels[b].mean(axis=1)
    robots.estimate[b, :, :3] = robots.pose[b]
    robots.estimate[b, :, 3] = robots.speed[b]
    robots.covariance[b] = INITIAL_VARIANCE * np.eye(4)
    robots.orders[b] = speed, turning
    robots.speeds[b, 0], robots.arcs[b, 0] = robots.speed[b], robots.arc[b]
