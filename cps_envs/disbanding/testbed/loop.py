"""One control period of an episode: decide, order by radio, then drive, look and filter at every plant step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.constants import Constants, constants_of, episode_of
from cps_envs.disbanding.dynamics import account
from cps_envs.disbanding.state import State
from cps_envs.disbanding.testbed.kalman import correct, predict
from cps_envs.disbanding.testbed.platoons import decide, mark_touching
from cps_envs.disbanding.testbed.robot import advanced_arc, drive
from cps_envs.disbanding.testbed.rules import Rules
from cps_envs.disbanding.testbed.state import Floats, Robots
from cps_envs.disbanding.testbed.steering import order_speed, pursue


@kernel
def send_orders(robots: Robots, b: int, command: Floats, rules: Rules) -> None:
    """New orders from the commands (M,) in m/s2 of road; those sent before move one period towards acting."""
    orders = robots.orders[b]
    for age in range(orders.shape[0] - 1, 0, -1):
        orders[age] = orders[age - 1]
    for q in range(command.shape[0]):
        estimate = robots.estimate[b, q]
        orders[0, q, 0] = order_speed(estimate[3], command[q] / rules.scale, robots.integral[b], q, rules)
        orders[0, q, 1] = pursue(estimate, rules)


@kernel
def step_robots(robots: Robots, b: int, step: int, rules: Rules) -> None:
    """One plant step of every robot of an episode, a camera picture, and what the filters make of it."""
    decided, acting = robots.orders[b, 0], robots.orders[b, -1]
    for q in range(robots.speed.shape[1]):
        pose, draw, estimate, covariance = (
            robots.pose[b, q],
            robots.noise[b, step, q],
            robots.estimate[b, q],
            robots.covariance[b, q],
        )
        robots.speed[b, q] = drive(
            pose, robots.wheels[b, q], robots.gains[b, q], acting[q, 0], acting[q, 1], draw[0], rules
        )
        robots.arc[b, q] = advanced_arc(robots.arc[b, q], pose[0], pose[1], rules.radius_m)
        predict(estimate, covariance, decided[q, 1], rules)
        seen_x, seen_y = pose[0] + rules.camera_noise_m * draw[1], pose[1] + rules.camera_noise_m * draw[2]
        correct(estimate, covariance, seen_x, seen_y, rules)


@kernel
def look(robots: Robots, b: int, episode: State, rules: Rules) -> None:
    """Fill the episode's positions (m), speeds (m/s) and accelerations (m/s2) of road from the filters.

    Robots have no accelerometer: the command of the last period stands for the acceleration.
    """
    scale = rules.scale
    for q in range(robots.speed.shape[1]):
        estimate = robots.estimate[b, q]
        arc = advanced_arc(episode.position[q] / scale, estimate[0], estimate[1], rules.radius_m)
        episode.position[q], episode.speed[q], episode.acceleration[q] = (
            scale * arc,
            scale * estimate[3],
            episode.command[q],
        )


@kernel
def record(robots: Robots, b: int, period: int, rules: Rules) -> None:
    """Keep the true speeds and places at the end of a period, and add up the errors of (2.8) in its window."""
    for q in range(robots.speed.shape[1]):
        speed = robots.speed[b, q]
        robots.speeds[b, period, q] = speed
        robots.arcs[b, period, q] = robots.arc[b, q]
        if rules.window_first < period <= rules.window_last:
            robots.error[b, q] += abs(speed - rules.desired_speed_mps)


@kernel
def run_episode(
    robots: Robots, b: int, episode: State, c: Constants, correction: Floats, num_periods: int, rules: Rules
) -> None:
    """Advance an episode by control periods, holding the corrections (M,) in m/s2 of road."""
    gap, closing = np.empty(c.num_vehicles), np.empty(c.num_vehicles)
    for _ in range(num_periods):
        decide(episode, c, rules, correction, gap, closing)
        send_orders(robots, b, episode.command, rules)
        first = episode.step[0] * rules.steps_per_period
        for step in range(first, first + rules.steps_per_period):
            step_robots(robots, b, step, rules)
        look(robots, b, episode, rules)
        mark_touching(episode, c, rules)
        account(episode, c)
        record(robots, b, episode.step[0], rules)


@kernel
def run(
    robots: Robots,
    string: State,
    parameters: NDArray[np.void],
    correction: Floats,
    envs: NDArray[np.bool_],
    num_periods: int,
    rules: Rules,
) -> None:
    """Advance the marked environments (B,) by control periods under corrections (B, M) in m/s2 of road."""
    for b in range(envs.shape[0]):
        if envs[b]:
            run_episode(
                robots, b, episode_of(string, b), constants_of(parameters, b), correction[b], num_periods, rules
            )
