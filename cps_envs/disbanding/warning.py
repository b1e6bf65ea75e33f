"""What the defender is told of disbanded platoons: by a broadcast to each platoon, or by each vehicle's record."""

from __future__ import annotations

from cps_envs.core.compute.kernels import Record, inlined
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.controllers import has_begun
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.fields import MAX_DISTANCE_M
from cps_envs.disbanding.state import Constants, State


@inlined
def fill_records(episode: State, c: Constants, row: FloatArray, at: Record, time_s: float) -> None:
    """What every vehicle has been told by the one ahead, field by field."""
    size = c.vehicles_per_platoon
    for q in range(size, c.num_vehicles):
        fill_record(episode, c, q, row, at, time_s, q - size)


@inlined
def fill_record(episode: State, c: Constants, q: int, row: FloatArray, at: Record, time_s: float, i: int) -> None:
    """What vehicle `q` has been told, at place `i` of each field, or the values that stand for nothing."""
    intact = not has_begun(time_s, episode.disbanding_s[q // c.vehicles_per_platoon])
    told = intact and episode.record_s[q] <= time_s
    row[at.warned + i] = told
    row[at.record_age_s + i] = time_s - episode.record_s[q] if told else 0.0
    row[at.silence_s + i] = time_s - episode.heard_s[q]
    row[at.ahead_speed + i] = episode.record_speed[q] if told else c.desired_speed_mps
    row[at.ahead_acceleration + i] = episode.record_acceleration[q] if told else 0.0
    row[at.ahead_command + i] = episode.record_command[q] if told else 0.0
    row[at.ahead_distance + i] = episode.record_position[q] - episode.position[q] if told else MAX_DISTANCE_M


@inlined
def fill_broadcast(
    episode: State, c: Constants, gap: FloatArray, law: FloatArray, row: FloatArray, at: Record, time_s: float
) -> None:
    """The entries of every platoon: disbanded or not, and the nearest disbanded vehicle ahead of it, `d`."""
    size, platoons, d = c.vehicles_per_platoon, c.num_vehicles // c.vehicles_per_platoon, -1
    for platoon in range(platoons):
        i = platoons - 1 - platoon
        if platoon > 0:
            row[at.ahead_speed + i] = episode.speed[d] if d >= 0 else c.desired_speed_mps
            row[at.ahead_acceleration + i] = episode.acceleration[d] if d >= 0 else 0.0
            row[at.ahead_command + i] = disbanded_command(episode, c, gap, law, d)
            distance = episode.position[d] - episode.position[platoon * size] if d >= 0 else MAX_DISTANCE_M
            row[at.ahead_distance + i] = distance
        if has_begun(time_s, episode.disbanding_s[platoon]):
            row[at.disbanded + i] = 1.0
            d = (platoon + 1) * size - 1


@inlined
def disbanded_command(episode: State, c: Constants, gap: FloatArray, law: FloatArray, d: int) -> float:
    """Final command (m/s2) of the disbanded vehicle `d`, which may exceed [u_min, u_max]; 0 if d = -1."""
    return final_command(law[d], gap[d], episode.speed[d], episode.speed[max(d - 1, 0)], c) if d >= 0 else 0.0
