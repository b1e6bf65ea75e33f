"""Kernels that read observations off a state: each field of `fields.py` by its name, in its unit, then encoded."""

from __future__ import annotations

from cps_envs.core.compute.kernels import Record, borrowed, fill, inlined, kernel, room, unpack
from cps_envs.core.declare.fields import encode_row
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.rogue.controllers import DRIVEN
from cps_envs.rogue.formation import reference_position
from cps_envs.rogue.noise import noise
from cps_envs.rogue.state import Drawn, Rules, State, platoon

CENTRAL, LOCAL = 1_000, 1_000_000  # where the noise of the defender and of single vehicles is numbered from
PER_VEHICLE, SEAT = 6, 4  # numbers for the noise of a vehicle, and of a seized one as the attacker sees it


@kernel
def observe_attacker(
    state: State, drawn: Array, rules: Array, offsets: Array, scale: FloatArray, encoded: Observation
) -> None:
    """Fill `encoded` (B, size) with `attacker_fields`."""
    r, at, row = unpack(Rules, rules, 0), borrowed(offsets)[0], room(scale.shape[1])
    for b in range(encoded.shape[0]):
        c = unpack(Drawn, drawn, b)
        episode = platoon(state, b, c.num_vehicles)
        fill(row, 0.0)
        seat = 0
        for i in range(c.attacker, episode.rogue.size):
            if episode.rogue[i]:
                sense_sides(episode, i, SEAT * seat, seat, c, r, at, row)
                row[at.speed + seat], row[at.effort + seat] = episode.speed[i], episode.effort[i]
                row[at.attacker_index + seat] = i + 1
                seat += 1
        row[at.reference_speed] = c.reference_speed_mps
        row[at.power_ratio] = c.attacker_drive_mps2 / c.drive_mps2
        fill(row[at.num_vehicles : at.until_onset_s], c.num_vehicles)
        row[at.until_onset_s] = max(c.onset_step - episode.step[0], 0) * r.dt_s
        row[at.time_left_s] = time_left(episode, r)
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])


@kernel
def observe_defender(
    state: State, drawn: Array, rules: Array, offsets: Array, scale: FloatArray, encoded: Observation
) -> None:
    """Fill `encoded` (B, size) with `defender_fields`."""
    r, at, row = unpack(Rules, rules, 0), borrowed(offsets)[0], room(scale.shape[1])
    for b in range(encoded.shape[0]):
        c = unpack(Drawn, drawn, b)
        episode = platoon(state, b, c.num_vehicles)
        fill(row, 0.0)
        fill_platoon(episode, c, r, at, row)
        fill_ordered(episode, c, r, at, row)
        seat = at.attacker_index
        for i in range(c.attacker, episode.rogue.size):
            if episode.rogue[i] and seat < at.present:
                row[seat], seat = i + 1, seat + 1
        absent = state.speed.shape[1] - c.num_vehicles
        fill(row[at.present : at.time_left_s - absent], 1.0)
        row[at.time_left_s] = time_left(episode, r)
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])


@kernel
def observe_vehicles(
    state: State, drawn: Array, rules: Array, offsets: Array, scale: FloatArray, encoded: Observation
) -> None:
    """Fill `encoded` (B, k, size) with `vehicle_fields` of the k vehicles that get orders."""
    r, at, row = unpack(Rules, rules, 0), borrowed(offsets)[0], room(scale.shape[1])
    for b in range(encoded.shape[0]):
        c = unpack(Drawn, drawn, b)
        episode = platoon(state, b, c.num_vehicles)
        i = -1
        for k in range(encoded.shape[1]):
            i = next_ordered(episode, i, r)
            fill(row, 0.0)
            row[at.time_left_s] = time_left(episode, r)
            if i < c.num_vehicles:
                fill_vehicle(episode, i, c, r, at, row)
            encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b, k])


@inlined
def next_ordered(episode: State, i: int, r: Rules) -> int:
    """The vehicle ahead of vehicle `i` that gets orders; beyond the leader there are those that a platoon lacks."""
    i += 1
    while i < episode.rogue.size and episode.rogue[i] and not r.hidden:
        i += 1
    return i


@inlined
def time_left(episode: State, r: Rules) -> float:
    """Time until the end of the episode, s."""
    return float((r.horizon_steps - episode.step[0]) * r.dt_s)


@inlined
def sense_sides(episode: State, i: int, entry: int, seat: int, c: Drawn, r: Rules, at: Record, row: FloatArray) -> None:
    """Gap errors and gap rates ahead of and behind vehicle `i`, entries `seat`, with noise numbered from `entry` on."""
    x, v, seed, now = episode.position, episode.speed, c.noise_seed, episode.step[0]
    if i + 1 < x.size:
        row[at.front_gap_error + seat] = x[i + 1] - x[i] - r.separation_m + noise(r.range_noise_m, seed, now, entry)
        row[at.front_gap_rate + seat] = v[i + 1] - v[i] + noise(r.range_rate_noise_mps, seed, now, entry + 1)
    if i > 0:
        row[at.rear_gap_error + seat] = x[i] - x[i - 1] - r.separation_m + noise(r.range_noise_m, seed, now, entry + 2)
        row[at.rear_gap_rate + seat] = v[i] - v[i - 1] + noise(r.range_rate_noise_mps, seed, now, entry + 3)


@inlined
def fill_platoon(episode: State, c: Drawn, r: Rules, at: Record, row: FloatArray) -> None:
    """What is seen of pairs and vehicles, and of the leader's reference."""
    x, v, seed, now, n = episode.position, episode.speed, c.noise_seed, episode.step[0], episode.speed.size
    for i in range(n - 1):
        error = noise(r.range_noise_m, seed, now, CENTRAL + i)
        row[at.gap_error + i] = x[i + 1] - x[i] - r.separation_m + error
        row[at.gap_rate + i] = v[i + 1] - v[i] + noise(r.range_rate_noise_mps, seed, now, CENTRAL + n + i)
    for i in range(n):
        row[at.speed + i] = v[i] + noise(r.speed_noise_mps, seed, now, CENTRAL + 3 * n + i)
        error = noise(r.acceleration_noise_mps2, seed, now, CENTRAL + 2 * n + i)
        row[at.acceleration + i] = episode.acceleration[i] + error
    row[at.reference_error] = reference_position(episode, c, r) - x[n - 1]
    row[at.reference_speed] = c.reference_speed_mps


@inlined
def fill_ordered(episode: State, c: Drawn, r: Rules, at: Record, row: FloatArray) -> None:
    """Detectors, alarms, growths and controllers of the vehicles with orders, as far as there are fields for them."""
    rear, i = at.rear_detector, -1
    watching, ordered = rear - at.front_detector, at.growth - at.alarm  # those that may have somebody ahead; all
    unwatched = ordered - (at.alarm - rear)  # from the rear on, that can have nobody behind
    for k in range(ordered):
        i = next_ordered(episode, i, r)
        if i >= c.num_vehicles:
            break
        if k < watching:
            row[at.front_detector + k] = episode.front_detector[i]
        if k >= unwatched and not r.hidden:
            row[rear + k - unwatched] = episode.rear_detector[i]
        row[at.alarm + k] = episode.alarm[i]
        if at.law > at.growth:
            row[at.growth + k] = episode.growth[i]
            if episode.controller[i] < len(DRIVEN):
                row[at.law + len(DRIVEN) * k + episode.controller[i]] = 1.0


@inlined
def fill_vehicle(episode: State, i: int, c: Drawn, r: Rules, at: Record, row: FloatArray) -> None:
    """The own row of vehicle `i`."""
    leader, entry, deviation = episode.speed.size - 1, LOCAL + PER_VEHICLE * i, r.acceleration_noise_mps2
    sense_sides(episode, i, entry, 0, c, r, at, row)
    row[at.leads], row[at.trails] = i == leader, i == 0
    row[at.speed], row[at.reference_speed] = episode.speed[i], c.reference_speed_mps
    if i == leader:
        row[at.front_gap_error] = reference_position(episode, c, r) - episode.position[i]
        row[at.front_gap_rate] = c.reference_speed_mps - episode.speed[i]
    else:
        error = noise(deviation, c.noise_seed, episode.step[0], entry + 4)
        row[at.front_acceleration] = episode.acceleration[i + 1] + error
    if i > 0:
        error = noise(deviation, c.noise_seed, episode.step[0], entry + 5)
        row[at.rear_acceleration] = episode.acceleration[i - 1] + error
    row[at.front_detector], row[at.rear_detector] = episode.front_detector[i], episode.rear_detector[i]
    row[at.alarm] = episode.alarm[i]
    if at.law > at.growth:
        row[at.growth] = episode.growth[i]
        if episode.controller[i] < len(DRIVEN):
            row[at.law + episode.controller[i]] = 1.0
