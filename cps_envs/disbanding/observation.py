"""Kernels that read observations off a state, in physical units and in the order of `fields.py`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.commands import avoidance_margin, clip, has_begun
from cps_envs.disbanding.constants import Constants, constants_of, episode_of
from cps_envs.disbanding.dynamics import STOP_MPS, command_by_law, final_command, first_mitigable
from cps_envs.disbanding.fields import MAX_DISTANCE_M, MAX_GAP_M
from cps_envs.disbanding.metrics import METRICS
from cps_envs.disbanding.state import State

VELOCITY_ERROR = METRICS.index("velocity_error_all")
COLLIDED = METRICS.index("collided")
Values = NDArray[np.float64]


@kernel
def fill_road(c: Constants, time_s: float, metrics: Values, row: Values) -> None:
    """The five entries of the road as a whole at the end of `row`."""
    row[-5] = time_s
    row[-4] = metrics[VELOCITY_ERROR]
    row[-3] = metrics[COLLIDED]
    row[-2] = c.tau_s
    row[-1] = c.desired_gap_m


@kernel
def observe_attacker(
    state: State, parameters: NDArray[np.void], metrics: Values, budget: NDArray[np.int64], drawn: bool, out: Values
) -> None:
    """Fill `out` (B, size) with `attacker_fields`; `drawn` tells whether the field `present` is there."""
    out[:] = 0.0
    for b in range(out.shape[0]):
        c, episode, row = constants_of(parameters, b), episode_of(state, b), out[b]
        size, rows = c.vehicles_per_platoon, episode.disbanding_s.shape[0]
        platoons, time_s = c.num_vehicles // size, episode.step[0] * c.dt_s
        for platoon in range(platoons):
            i = platoons - 1 - platoon  # row of the paper's platoon i + 1
            fill_platoon(episode, c, platoon, row, i, rows, time_s)
        if drawn:
            row[-6 - rows : platoons - 6 - rows] = 1.0
        row[-6] = budget[b]
        fill_road(c, time_s, metrics[b], row)


@kernel
def fill_platoon(episode: State, c: Constants, platoon: int, row: Values, i: int, rows: int, time_s: float) -> None:
    """The entries of one platoon (counted from the front) in row `i` of the attacker's `rows` rows."""
    size = c.vehicles_per_platoon
    first = platoon * size
    total, slowest, stopped = 0.0, np.inf, 0
    for q in range(first, first + size):
        total += episode.speed[q]
        slowest = min(slowest, episode.speed[q])
        stopped += episode.speed[q] < STOP_MPS
    narrowest = np.inf
    for q in range(first + 1, first + size):
        narrowest = min(narrowest, episode.position[q - 1] - episode.position[q])
    row[i] = total / size
    row[rows + i] = slowest
    if platoon > 0:
        row[2 * rows + i] = episode.position[first - 1] - episode.position[first]
    inner = 3 * rows - 1
    row[inner + i] = (episode.position[first] - episode.position[first + size - 1]) / (size - 1)
    row[inner + rows + i] = narrowest
    row[inner + 2 * rows + i] = stopped / size
    if has_begun(time_s, episode.disbanding_s[platoon]):
        row[inner + 3 * rows + i] = 1.0
        row[inner + 4 * rows + i] = time_s - episode.disbanding_s[platoon]


@kernel
def nearest_disbanded(episode: State, c: Constants, platoon: int, time_s: float) -> int:
    """The last vehicle of the nearest disbanded platoon ahead of `platoon` (counted from the front); -1 if none."""
    for ahead in range(platoon - 1, -1, -1):
        if has_begun(time_s, episode.disbanding_s[ahead]):
            return (ahead + 1) * c.vehicles_per_platoon - 1
    return -1


@kernel
def disbanded_command(episode: State, c: Constants, gap: Values, law: Values, d: int) -> float:
    """Final command (m/s2) of the disbanded vehicle `d`, which may exceed [u_min, u_max]; 0 if d = -1."""
    return final_command(law[d], gap[d], episode.speed[d], episode.speed[max(d - 1, 0)], c) if d >= 0 else 0.0


@kernel
def observe_defender(state: State, parameters: NDArray[np.void], metrics: Values, drawn: bool, out: Values) -> None:
    """Fill `out` (B, size) with `defender_fields`; `drawn` tells whether the field `present` is there."""
    out[:] = 0.0
    for b in range(out.shape[0]):
        c, episode, row = constants_of(parameters, b), episode_of(state, b), out[b]
        gap, closing, law = np.empty(c.num_vehicles), np.empty(c.num_vehicles), np.empty(c.num_vehicles)
        command_by_law(episode, c, gap, closing, law)
        time_s = episode.step[0] * c.dt_s
        fill_vehicles(episode, c, gap, closing, law, row, time_s)
        fill_broadcast(episode, c, gap, law, row, time_s)
        if drawn:
            rows = episode.disbanding_s.shape[0]
            row[-5 - rows : c.num_vehicles // c.vehicles_per_platoon - 5 - rows] = 1.0
        fill_road(c, time_s, metrics[b], row)


@kernel
def fill_vehicles(
    episode: State, c: Constants, gap: Values, closing: Values, law: Values, row: Values, time_s: float
) -> None:
    """The entries of every vehicle, up to and including `mitigable`."""
    size, width, mitigable = c.vehicles_per_platoon, episode.speed.shape[0], first_mitigable(episode, c)
    for q in range(c.num_vehicles):
        row[q] = episode.speed[q]
        row[width + q] = episode.acceleration[q]
        if q > 0:
            row[2 * width + q - 1] = gap[q]
            row[3 * width + q - 2] = closing[q]
        row[4 * width - 2 + q] = clip(law[q], c.min_acceleration_mps2, c.max_acceleration_mps2)
        if q >= mitigable and not has_begun(time_s, episode.disbanding_s[q // size]):
            row[5 * width - 2 + q - size] = 1.0


@kernel
def fill_broadcast(episode: State, c: Constants, gap: Values, law: Values, row: Values, time_s: float) -> None:
    """The entries of every platoon: disbanded or not, and the nearest disbanded vehicle ahead of it."""
    size, width, rows = c.vehicles_per_platoon, episode.speed.shape[0], episode.disbanding_s.shape[0]
    platoons = c.num_vehicles // size
    start = 6 * width - 2 - size
    ahead = start + rows
    for platoon in range(platoons):
        i = platoons - 1 - platoon
        row[start + i] = has_begun(time_s, episode.disbanding_s[platoon])
        if platoon > 0:
            d = nearest_disbanded(episode, c, platoon, time_s)
            row[ahead + i] = episode.speed[d] if d >= 0 else c.desired_speed_mps
            row[ahead + rows - 1 + i] = episode.acceleration[d] if d >= 0 else 0.0
            row[ahead + 2 * (rows - 1) + i] = disbanded_command(episode, c, gap, law, d)
            distance = episode.position[d] - episode.position[platoon * size] if d >= 0 else MAX_DISTANCE_M
            row[ahead + 3 * (rows - 1) + i] = distance


@kernel
def observe_vehicles(state: State, parameters: NDArray[np.void], out: Values) -> None:
    """Fill `out` (B, M, size) with `vehicle_fields`; absent vehicles keep zeros."""
    out[:] = 0.0
    for b in range(out.shape[0]):
        c, episode = constants_of(parameters, b), episode_of(state, b)
        gap, closing, law = np.empty(c.num_vehicles), np.empty(c.num_vehicles), np.empty(c.num_vehicles)
        command_by_law(episode, c, gap, closing, law)
        for q in range(c.num_vehicles):
            fill_vehicle(episode, c, gap, closing, law, q, out[b, q])


@kernel
def fill_vehicle(episode: State, c: Constants, gap: Values, closing: Values, law: Values, q: int, row: Values) -> None:
    """The own row of vehicle `q`."""
    size, rear, time_s = c.vehicles_per_platoon, c.num_vehicles - 1, episode.step[0] * c.dt_s
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    platoon, speed, before = q // size, episode.speed[q], max(q - 1, 0)
    intact = not has_begun(time_s, episode.disbanding_s[platoon])
    leads, trails = q % size == 0, q % size == size - 1
    desired = c.headway_s * speed if leads else c.desired_gap_m
    row[0] = intact
    row[1] = intact and q >= first_mitigable(episode, c)
    row[2] = leads
    row[3] = trails
    row[4] = q / rear
    row[5] = speed
    row[6] = episode.acceleration[q]
    row[7] = min(gap[q], MAX_GAP_M)
    row[8] = gap[q] - desired if q > 0 else 0.0
    row[9] = gap[q + 1] - c.desired_gap_m if q < rear else 0.0
    row[10] = closing[q]
    row[11] = closing[q + 1] if q < rear else 0.0
    one_sided = c.one_sided_avoidance
    row[12] = avoidance_margin(row[7], speed, episode.speed[before], c.standstill_gap_m, -low, one_sided)
    row[13] = clip(law[q], low, high)
    row[14] = episode.acceleration[before] if q > 0 else 0.0
    row[15] = clip(episode.command[before], low, high) if q > 0 else 0.0
    row[16] = since_disbanding(episode, platoon, time_s)
    d = nearest_disbanded(episode, c, platoon, time_s)
    row[17] = episode.speed[d] if d >= 0 else c.desired_speed_mps
    row[18] = episode.acceleration[d] if d >= 0 else 0.0
    row[19] = episode.position[d] - episode.position[q] if d >= 0 else MAX_DISTANCE_M
    row[20] = c.tau_s
    row[21] = c.desired_gap_m


@kernel
def since_disbanding(episode: State, platoon: int, time_s: float) -> float:
    """Time (s) since the first disbanding ahead of `platoon`; 0 if there was none."""
    longest = 0.0
    for ahead in range(platoon):
        longest = max(longest, time_s - episode.disbanding_s[ahead])
    return longest
