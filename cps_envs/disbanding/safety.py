"""What a defence risks and what it does in vain, noted once per control period."""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.controllers import DEAD_BAND, has_begun, most_forward_disbanded
from cps_envs.disbanding.state import Constants, State


@inlined
def note_gaps(episode: State, c: Constants) -> None:
    """Keep the smallest gap ahead of an intact vehicle."""
    size, time_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s
    smallest = episode.smallest_gap[0]
    for platoon in range(c.num_vehicles // size):
        if not has_begun(time_s, episode.disbanding_s[platoon]):
            for q in range(max(platoon * size, 1), (platoon + 1) * size):
                smallest = min(smallest, episode.position[q - 1] - episode.position[q])
    episode.smallest_gap[0] = smallest


@inlined
def note_false_alarms(episode: State, c: Constants, correction: FloatArray) -> None:
    """Count the vehicles that are corrected, (M,) m/s2, although no platoon ahead of theirs is disbanded."""
    size, platoons = c.vehicles_per_platoon, c.num_vehicles // c.vehicles_per_platoon
    front = most_forward_disbanded(episode.disbanding_s, platoons, episode.step[0] * c.dt_s)
    first = 0 if c.corrects_all else c.num_vehicles
    alarmed = 0
    for q in range(first, min(front, platoons) * size):
        alarmed += abs(correction[q]) >= DEAD_BAND
    episode.false_alarms[0] += alarmed / c.num_vehicles
