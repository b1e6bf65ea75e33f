"""The platoons' commands on the test bed: the laws of the disbanding problem, applied to estimates.

A `State` holds what the filters say, in metres of road; its step is a control period.
"""

from __future__ import annotations

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.commands import clip, has_begun
from cps_envs.disbanding.constants import Constants
from cps_envs.disbanding.dynamics import command_by_law, correct_commands, final_command, first_mitigable, involve
from cps_envs.disbanding.state import State
from cps_envs.disbanding.testbed.rules import Rules
from cps_envs.disbanding.testbed.state import Floats


@kernel
def law_commands(episode: State, c: Constants, rules: Rules, gap: Floats, closing: Floats, u: Floats) -> None:
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


@kernel
def decide(episode: State, c: Constants, rules: Rules, correction: Floats, gap: Floats, closing: Floats) -> None:
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


@kernel
def mark_touching(episode: State, c: Constants, rules: Rules) -> None:
    """Note the robots whose gap ahead is below the length of a body, and their predecessors."""
    for q in range(1, c.num_vehicles):
        if episode.position[q - 1] - episode.position[q] < rules.scale * rules.body_length_m:
            episode.rear_collided[q] = True
            involve(episode, c, q)
            involve(episode, c, q - 1)
