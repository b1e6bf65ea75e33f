"""Kernels that read observations off a state: each field of `fields.py` by its name, in its unit, then encoded."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, clip, fill, inlined, kernel, room, unpack, view
from cps_envs.core.declare.fields import encode_row
from cps_envs.core.types import Array, FloatArray, IntArray, Observation
from cps_envs.disbanding.attack import opens_s
from cps_envs.disbanding.controllers import avoidance_margin, has_begun
from cps_envs.disbanding.dynamics import STOP_MPS, command_by_law, first_mitigable
from cps_envs.disbanding.fields import MAX_DISTANCE_M, MAX_GAP_M
from cps_envs.disbanding.state import Constants, State
from cps_envs.disbanding.warning import fill_broadcast, fill_record, fill_records


@kernel
def observe_attacker(
    state: State,
    constants: Array,
    metrics: Array,
    budget: IntArray,
    offsets: Array,
    scale: FloatArray,
    encoded: Observation,
) -> None:
    """Fill `encoded` (B, size) with `attacker_fields`, given their offsets and scale; `metrics`, `budget`: (B,)."""
    at, row = borrowed(offsets)[0], room(encoded.shape[1])
    for b in range(encoded.shape[0]):
        c, episode = unpack(Constants, constants, b), view(state, b)
        platoons, time_s = c.num_vehicles // c.vehicles_per_platoon, episode.step[0] * c.dt_s
        fill(row, 0.0)
        for platoon in range(platoons):
            fill_platoon(episode, c, platoon, row, at, platoons - 1 - platoon, time_s)  # the paper's platoon i + 1
        fill_present(row, at.present, at.budget_left, platoons)
        row[at.budget_left] = budget[b]
        fill_means(episode, c, row, at, time_s)
        fill_road(c, time_s, borrowed(metrics)[b], row, at)
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])


@inlined
def fill_means(episode: State, c: Constants, row: FloatArray, at: Record, time_s: float) -> None:
    """What the attacker may do, beside the budget, where those fields are there."""
    if at.jam_left_s > at.opens_in_s:
        row[at.opens_in_s] = max(0.0, opens_s(episode, c) - time_s)
    if at.jammed > at.jam_left_s:
        row[at.jam_left_s] = episode.jam_steps[0] * c.dt_s
        if episode.jam_place[0] >= 0:
            row[at.jammed + c.num_vehicles // c.vehicles_per_platoon - 2 - episode.jam_place[0]] = 1.0


@inlined
def fill_present(row: FloatArray, first: int, end: int, platoons: int) -> None:
    """One for each platoon of the episode, where the field `present` is there: between `first` and `end`."""
    fill(row[first : min(first + platoons, end)], 1.0)


@inlined
def fill_road(c: Constants, time_s: float, metrics: Record, row: FloatArray, at: Record) -> None:
    """The entries of the road as a whole."""
    row[at.time_s] = time_s
    row[at.velocity_error] = metrics.velocity_error_all
    row[at.collided] = metrics.collided
    row[at.tau_s] = c.tau_s
    row[at.desired_gap_m] = c.desired_gap_m


@inlined
def fill_platoon(
    episode: State, c: Constants, platoon: int, row: FloatArray, at: Record, i: int, time_s: float
) -> None:
    """The entries of one platoon (counted from the front) at place `i` of each of the attacker's fields."""
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
    row[at.mean_speed + i] = total / size
    row[at.min_speed + i] = slowest
    if platoon > 0:
        row[at.leader_gap + i] = episode.position[first - 1] - episode.position[first]
    row[at.mean_gap + i] = (episode.position[first] - episode.position[first + size - 1]) / (size - 1)
    row[at.min_gap + i] = narrowest
    row[at.stopped + i] = stopped / size
    if has_begun(time_s, episode.disbanding_s[platoon]):
        row[at.disbanded + i] = 1.0
        row[at.since_disbanding_s + i] = time_s - episode.disbanding_s[platoon]


@kernel
def observe_defender(
    state: State, constants: Array, metrics: Array, offsets: Array, scale: FloatArray, encoded: Observation
) -> None:
    """Fill `encoded` (B, size) with `defender_fields`, whose offsets and scale are given; `metrics` (B,)."""
    at, row = borrowed(offsets)[0], room(encoded.shape[1])
    vehicles = state.speed.shape[1]
    gap, closing, law = room(vehicles), room(vehicles), room(vehicles)
    for b in range(encoded.shape[0]):
        c, episode = unpack(Constants, constants, b), view(state, b)
        command_by_law(episode, c, gap, closing, law)
        fill(row, 0.0)
        fill_defender(episode, c, gap, closing, law, borrowed(metrics)[b], row, at)
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])


@inlined
def fill_defender(
    episode: State,
    c: Constants,
    gap: FloatArray,
    closing: FloatArray,
    law: FloatArray,
    metrics: Record,
    row: FloatArray,
    at: Record,
) -> None:
    """All of `defender_fields`, given gaps (m), closing speeds (m/s) and plain commands `law` (m/s2), (M,)."""
    time_s = episode.step[0] * c.dt_s
    fill_vehicles(episode, c, gap, closing, law, row, at, time_s)
    if c.relayed:
        fill_records(episode, c, row, at, time_s)
    else:
        fill_broadcast(episode, c, gap, law, row, at, time_s)
    fill_present(row, at.present, at.time_s, c.num_vehicles // c.vehicles_per_platoon)
    fill_road(c, time_s, metrics, row, at)


@inlined
def fill_vehicles(
    episode: State,
    c: Constants,
    gap: FloatArray,
    closing: FloatArray,
    law: FloatArray,
    row: FloatArray,
    at: Record,
    time_s: float,
) -> None:
    """The entries of every vehicle, up to and including `mitigable`."""
    size, mitigable = c.vehicles_per_platoon, first_mitigable(episode, c)
    unlisted = 0 if c.corrects_all else size
    for q in range(c.num_vehicles):
        row[at.speed + q] = episode.speed[q]
        row[at.acceleration + q] = episode.acceleration[q]
        row[at.law_command + q] = clip(law[q], c.min_acceleration_mps2, c.max_acceleration_mps2)
    for q in range(1, c.num_vehicles):
        row[at.gap + q - 1] = gap[q]
        row[at.relative_speed + q - 1] = closing[q]
    for q in range(mitigable, c.num_vehicles):
        if not has_begun(time_s, episode.disbanding_s[q // size]):
            row[at.mitigable + q - unlisted] = 1.0


@kernel
def observe_vehicles(state: State, constants: Array, offsets: Array, scale: FloatArray, encoded: Observation) -> None:
    """Fill `encoded` (B, M, size) with `vehicle_fields`, whose offsets and scale are given; absent vehicles: zeros."""
    at, row = borrowed(offsets)[0], room(encoded.shape[2])
    vehicles = encoded.shape[1]
    gap, closing, law = room(vehicles), room(vehicles), room(vehicles)
    for b in range(encoded.shape[0]):
        c, episode = unpack(Constants, constants, b), view(state, b)
        command_by_law(episode, c, gap, closing, law)
        mitigable, time_s = first_mitigable(episode, c), episode.step[0] * c.dt_s
        d, longest_s = -1, 0.0  # the nearest disbanded vehicle ahead; the time since the first disbanding ahead
        for q in range(vehicles):
            fill(row, 0.0)
            if q < c.num_vehicles:
                fill_own(episode, c, gap, closing, law, q, row, at)
                platoon = q // c.vehicles_per_platoon
                intact = not has_begun(time_s, episode.disbanding_s[platoon])
                row[at.active], row[at.mitigable] = intact, intact and q >= mitigable
                if c.relayed:
                    fill_record(episode, c, q, row, at, time_s, 0)
                else:
                    row[at.since_disbanding_s] = longest_s
                    row[at.ahead_speed] = episode.speed[d] if d >= 0 else c.desired_speed_mps
                    row[at.ahead_acceleration] = episode.acceleration[d] if d >= 0 else 0.0
                    row[at.ahead_distance] = episode.position[d] - episode.position[q] if d >= 0 else MAX_DISTANCE_M
                if row[at.trails] > 0.0:
                    longest_s = max(longest_s, time_s - episode.disbanding_s[platoon])
                    d = d if intact else q
            encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b, q])


@inlined
def fill_own(
    episode: State,
    c: Constants,
    gap: FloatArray,
    closing: FloatArray,
    law: FloatArray,
    q: int,
    row: FloatArray,
    at: Record,
) -> None:
    """What vehicle `q` knows of itself and its neighbours."""
    size, rear, speed, before = c.vehicles_per_platoon, c.num_vehicles - 1, episode.speed[q], max(q - 1, 0)
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    leads, space = q % size == 0, min(gap[q], MAX_GAP_M)
    row[at.leads], row[at.trails], row[at.place] = leads, q % size == size - 1, q / rear
    row[at.speed], row[at.acceleration], row[at.gap] = speed, episode.acceleration[q], space
    row[at.gap_error] = gap[q] - (c.headway_s * speed if leads else c.desired_gap_m) if q > 0 else 0.0
    row[at.rear_gap_error] = gap[q + 1] - c.desired_gap_m if q < rear else 0.0
    row[at.relative_speed] = closing[q]
    row[at.rear_relative_speed] = closing[q + 1] if q < rear else 0.0
    margin = avoidance_margin(space, speed, episode.speed[before], c.standstill_gap_m, -low, c.one_sided_avoidance)
    row[at.avoidance_margin] = margin
    row[at.law_command] = clip(law[q], low, high)
    row[at.predecessor_acceleration] = episode.acceleration[before] if q > 0 else 0.0
    row[at.predecessor_command] = clip(episode.command[before], low, high) if q > 0 else 0.0
    row[at.tau_s], row[at.desired_gap_m] = c.tau_s, c.desired_gap_m
