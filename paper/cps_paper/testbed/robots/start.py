"""The steady state in which the robots start, and what is drawn for an episode."""

from __future__ import annotations

import math

import numpy as np

from cps_envs.core.types import FloatArray
from cps_envs.disbanding.start import nominal_constants
from cps_envs.disbanding.state import Constants
from cps_paper.testbed.robots.config import RobotConfig
from cps_paper.testbed.robots.kalman import INITIAL_VARIANCE
from cps_paper.testbed.robots.robot import wheel_target
from cps_paper.testbed.robots.state import Robots, rules_of


def draw_episode(robots: Robots, config: RobotConfig, generator: np.random.Generator) -> None:
    """Draw the errors of an episode's wheels and all of its noise."""
    robots.gains[:] = 1.0 + config.wheel_gain_spread * generator.standard_normal(robots.gains.shape)
    generator.standard_normal(out=robots.noise)


def string_constants(config: RobotConfig) -> Constants:
    """The numbers of the string, of which the road leaves none to chance; a step is a control period."""
    return nominal_constants(config.road)._replace(dt_s=config.control_period_s, saturate_command=True)


def place_robots(robots: Robots, config: RobotConfig, arcs_m: FloatArray) -> None:
    """Put an episode's robots on the circle at `arcs_m` (M,), all at the desired speed, and tell the filters."""
    radius, speed = config.radius_m, config.desired_speed_mps
    turning, rules, angle = speed / radius, rules_of(config), arcs_m / radius
    targets = np.array([wheel_target(speed, turning, side, rules) for side in (-1.0, 1.0)])
    for array in (robots.integral, robots.error, robots.speeds, robots.arcs):
        array[:] = 0.0
    robots.pose[:] = np.stack([radius * np.cos(angle), radius * np.sin(angle), angle + math.pi / 2], axis=1)
    robots.arc[:] = arcs_m
    robots.wheels[:] = targets * robots.gains
    robots.speed[:] = config.wheel_radius_m * robots.wheels.mean(axis=1)
    robots.estimate[:, :3] = robots.pose
    robots.estimate[:, 3] = robots.speed
    robots.covariance[:] = INITIAL_VARIANCE * np.eye(4)
    robots.orders[:] = speed, turning
    robots.speeds[0], robots.arcs[0] = robots.speed, robots.arc
