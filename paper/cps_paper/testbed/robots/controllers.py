"""What robots are told to do: commands of their platoons, and from these a speed and a turning rate.

A `disbanding.state.State` holds what the filters say, in metres of road; its step is a control period.
"""

from __future__ import annotations

import math

from cps_envs.core.compute.kernels import clip, inlined
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.controllers import has_begun
from cps_envs.disbanding.dynamics import command_by_law, correct_commands, final_command, first_mitigable, involve
from cps_envs.disbanding.state import Constants, State
from cps_paper.testbed.robots.robot import wrapped
from cps_paper.testbed.robots.state import Rules


@inlined
def law_commands(
    episode: State, c: Constants, rules: Rules, gap: FloatArray, closing: FloatArray, u: FloatArray
) -> None:
    """Fill gap (m), closing speed (m/s) and command `u` (m/s2) of every robot, all (M,).

    Robots that disband brake suddenly; without that a leader with a free road would not slow down at all.
    """
    command_by_law(episode, c, gap, closing, u)
    size, time_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s
    for platoon in range(c.num_vehicles // size):
        start_s = episode.disbanding_s[platoon]
        if has_begun(time_s, start_s) and not has_begun(time_s, start_s + rules.sudden_braking_s):
            for q in range(platoon * size, (platoon + 1) * size):
                u[q] = -rules.scale * rules.sudden_braking_mps2


@inlined
def decide(
    episode: State, c: Constants, rules: Rules, correction: FloatArray, gap: FloatArray, closing: FloatArray
) -> None:
    """Make the commands of the episode final under the defender's corrections (M,) in m/s2.

    Collision avoidance (2.6) acts on every robot with a predecessor; on mitigable ones only if the rules say so.
    """
    law_commands(episode, c, rules, gap, closing, episode.command)
    correct_commands(episode, c, correction)
    size, time_s, speed, mitigable = (
        c.vehicles_per_platoon,
        episode.step[0] * c.dt_s,
        episode.speed,
        first_mitigable(episode, c),
    )
    for q in range(c.num_vehicles):
        left = q >= mitigable and not has_begun(time_s, episode.disbanding_s[q // size])
        if left and not rules.avoids_always:
            episode.command[q] = clip(episode.command[q], c.min_acceleration_mps2, c.max_acceleration_mps2)
        else:
            episode.command[q] = final_command(episode.command[q], gap[q], speed[q], speed[max(q - 1, 0)], c)


@inlined
def mark_touching(episode: State, c: Constants, rules: Rules) -> None:
    """Note the robots whose gap ahead is below the length of a body, and their predecessors."""
    for q in range(1, c.num_vehicles):
        if episode.position[q - 1] - episode.position[q] < rules.scale * rules.body_length_m:
            episode.rear_collided[q] = True
            involve(episode, c, q)
            involve(episode, c, q - 1)


@inlined
def pursue(estimate: FloatArray, rules: Rules) -> float:
    """Turning rate (rad/s) towards the point of the circle `lookahead_m` of arc ahead of an estimate."""
    x, y, heading, speed = estimate[0], estimate[1], estimate[2], estimate[3]
    goal = math.atan2(y, x) + rules.lookahead_m / rules.radius_m
    across, along = rules.radius_m * math.cos(goal) - x, rules.radius_m * math.sin(goal) - y
    bearing = wrapped(math.atan2(along, across) - heading)
    return float(2.0 * max(speed, 0.0) * math.sin(bearing) / math.hypot(across, along))


@inlined
def order_speed(speed: float, acceleration: float, integral: FloatArray, robot: int, rules: Rules) -> float:
    """Speed order (m/s) of a robot for a wanted acceleration (m/s2); updates its entry of `integral` (M,)."""
    wanted = clip(speed + rules.control_period_s * acceleration, 0.0, rules.max_speed_mps)
    error = wanted - speed
    limit = rules.max_integral_m
    integral[robot] = clip(integral[robot] + rules.control_period_s * error, -limit, limit)
    order = wanted + rules.speed_gain * error + rules.speed_integral_gain * integral[robot]
    return clip(order, 0.0, rules.max_speed_mps)
