"""Drivers who take over because their vehicle moves irregularly, and the jolts with which an attacker makes it do so.

The dissertation's second question in 1.5: what happens if a passenger assumes command after observing irregular motion?
A driver is alarmed by hard braking or a jerk of the own vehicle, or by a gap that has become small; each driver has
limits of their own, and a reaction time. As soon as one driver takes over, the platoon is disbanded (2.1.2).
"""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.disbanding.controllers import has_begun
from cps_envs.disbanding.state import Constants, State


@inlined
def watch_motion(episode: State, c: Constants) -> None:
    """Once per control period: drivers of intact platoons who are alarmed take over after their reaction time.

    The jerk is the change of the acceleration since the last look, so that what is faster is not felt.
    """
    size, time_s, period_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s, c.period_steps * c.dt_s
    for q in range(c.num_vehicles):
        felt, before = episode.acceleration[q], episode.felt_mps2[q]
        episode.felt_mps2[q] = felt
        platoon = q // size
        if not has_begun(time_s, episode.disbanding_s[platoon]):
            alarmed = -felt > episode.alarming_braking_mps2[q]
            alarmed |= abs(felt - before) > episode.alarming_jerk_mps3[q] * period_s
            alarmed |= q > 0 and episode.position[max(q - 1, 0)] - episode.position[q] < episode.alarming_gap_m[q]
            if alarmed:
                takeover_s = time_s + episode.reaction_s[q]
                episode.disbanding_s[platoon] = min(episode.disbanding_s[platoon], takeover_s)


@inlined
def begin_jolt(episode: State, c: Constants, platoon: int, time_s: float) -> None:
    """Have the attacked vehicle of a platoon, counted from the front, brake from now on."""
    vehicle = platoon * c.vehicles_per_platoon + episode.attacked_member[0] - 1
    episode.jolted_until_s[vehicle] = time_s + c.jolt_s


@inlined
def jolt(episode: State, c: Constants) -> None:
    """Overwrite the commands (m/s2) of vehicles that a false reading makes brake, while nobody has taken over."""
    size, time_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s
    for q in range(c.num_vehicles):
        intact = not has_begun(time_s, episode.disbanding_s[q // size])
        if intact and not has_begun(time_s, episode.jolted_until_s[q]):
            episode.command[q] = min(episode.command[q], -c.jolt_mps2)
