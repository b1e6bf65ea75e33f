"""One control period of an episode: decide, order by radio, then drive, look and filter at every plant step."""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.dynamics import account
from cps_envs.disbanding.state import Constants, State
from cps_paper.testbed.robots.controllers import decide, mark_touching, order_speed, pursue
from cps_paper.testbed.robots.kalman import correct, predict
from cps_paper.testbed.robots.robot import advanced_arc, drive
from cps_paper.testbed.robots.state import Robots, Rules


@inlined
def send_orders(robots: Robots, command: FloatArray, rules: Rules) -> None:
    """New orders from the commands (M,) in m/s2 of road; those sent before move one period towards acting."""
    orders = robots.orders
    for age in range(orders.shape[0] - 1, 0, -1):
        for q in range(orders.shape[1]):
            orders[age, q, 0], orders[age, q, 1] = orders[age - 1, q, 0], orders[age - 1, q, 1]
    for q in range(command.size):
        estimate = robots.estimate[q]
        orders[0, q, 0] = order_speed(estimate[3], command[q] / rules.scale, robots.integral, q, rules)
        orders[0, q, 1] = pursue(estimate, rules)


@inlined
def step_robots(robots: Robots, step: int, rules: Rules) -> None:
    """One plant step of every robot of an episode, a camera picture, and what the filters make of it."""
    decided, acting = robots.orders[0], robots.orders[robots.orders.shape[0] - 1]
    for q in range(robots.speed.size):
        pose, draw, estimate, covariance = (
            robots.pose[q],
            robots.noise[step, q],
            robots.estimate[q],
            robots.covariance[q],
        )
        robots.speed[q] = drive(pose, robots.wheels[q], robots.gains[q], acting[q, 0], acting[q, 1], draw[0], rules)
        robots.arc[q] = advanced_arc(robots.arc[q], pose[0], pose[1], rules.radius_m)
        predict(estimate, covariance, decided[q, 1], rules)
        seen_x, seen_y = pose[0] + rules.camera_noise_m * draw[1], pose[1] + rules.camera_noise_m * draw[2]
        correct(estimate, covariance, seen_x, seen_y, rules)


@inlined
def look(robots: Robots, episode: State, rules: Rules) -> None:
    """Fill the episode's positions (m), speeds (m/s) and accelerations (m/s2) of road from the filters.

    Robots have no accelerometer: the command of the last period stands for the acceleration.
    """
    scale = rules.scale
    for q in range(robots.speed.size):
        estimate = robots.estimate[q]
        arc = advanced_arc(episode.position[q] / scale, estimate[0], estimate[1], rules.radius_m)
        episode.position[q] = scale * arc
        episode.speed[q] = scale * estimate[3]
        episode.acceleration[q] = episode.command[q]


@inlined
def record(robots: Robots, period: int, rules: Rules) -> None:
    """Keep the true speeds and places at the end of a period, and add up the errors of (2.8) in its window."""
    for q in range(robots.speed.size):
        speed = robots.speed[q]
        robots.speeds[period, q] = speed
        robots.arcs[period, q] = robots.arc[q]
        if rules.window_first < period <= rules.window_last:
            robots.error[q] += abs(speed - rules.desired_speed_mps)


@inlined
def run_episode(
    robots: Robots,
    episode: State,
    c: Constants,
    rules: Rules,
    correction: FloatArray,
    closing: FloatArray,
    num_periods: int,
) -> None:
    """Advance an episode by control periods, holding the corrections (M,) in m/s2 of road; `closing` (M,) is room."""
    for _ in range(num_periods):
        decide(episode, c, rules, correction, episode.previous_gap, closing)
        send_orders(robots, episode.command, rules)
        first = episode.step[0] * rules.steps_per_period
        for step in range(first, first + rules.steps_per_period):
            step_robots(robots, step, rules)
        look(robots, episode, rules)
        mark_touching(episode, c, rules)
        account(episode, c)
        record(robots, episode.step[0], rules)
