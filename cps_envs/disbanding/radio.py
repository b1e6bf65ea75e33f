"""The warning on its way: every vehicle passes its record of the nearest disbanded vehicle to the one behind.

A record is state, command and time of the vehicle that it tells of. The last vehicle of a disbanded platoon makes new
ones, from the moment of the attack on; intact vehicles hand on the last one that they have. All send once per
`hop_steps`, whether they have a record or not, and a message takes that long. It is lost with probability `hop_loss`,
and wherever the attacker blocks the link.
"""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.compute.streams import uniform
from cps_envs.disbanding.controllers import has_begun
from cps_envs.disbanding.state import Constants, State


@inlined
def pass_on(episode: State, c: Constants) -> None:
    """Let every vehicle send once; rear to front, so that no message goes two links at a time."""
    size, time_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s
    for q in range(c.num_vehicles - 1, 0, -1):
        lost = c.hop_loss > 0.0 and uniform(episode.chance) < c.hop_loss
        platoon = (q - 1) // size  # of the sender
        blocked = q % size == 0 and episode.jam_place[0] == platoon
        if not lost and not blocked:
            episode.heard_s[q] = time_s
        if has_begun(time_s, episode.disbanding_s[q // size]):
            if (q + 1) % size == 0:
                take_record(episode, q, q, time_s)
        elif not lost and not blocked and episode.record_s[q - 1] <= time_s:
            hand_on(episode, q, q - 1)


@inlined
def take_record(episode: State, q: int, d: int, time_s: float) -> None:
    """Vehicle `q` has a fresh record of the disbanded vehicle `d`."""
    episode.record_s[q] = time_s
    episode.record_position[q] = episode.position[d]
    episode.record_speed[q] = episode.speed[d]
    episode.record_acceleration[q] = episode.acceleration[d]
    episode.record_command[q] = episode.command[d]


@inlined
def hand_on(episode: State, q: int, sender: int) -> None:
    """Vehicle `q` receives the record that the sender has."""
    episode.record_s[q] = episode.record_s[sender]
    episode.record_position[q] = episode.record_position[sender]
    episode.record_speed[q] = episode.record_speed[sender]
    episode.record_acceleration[q] = episode.record_acceleration[sender]
    episode.record_command[q] = episode.record_command[sender]


@inlined
def wear_jam(episode: State) -> None:
    """Take one integration step off a jam that is on; it ends when the budget is spent."""
    if episode.jam_place[0] >= 0:
        episode.jam_steps[0] -= 1
        if episode.jam_steps[0] <= 0:
            episode.jam_place[0] = -1
