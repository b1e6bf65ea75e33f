"""Kernels that read observations off a state, in physical units and in the order of `fields.py`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.rogue.formation import reference_position
from cps_envs.rogue.kernel import Record, kernel
from cps_envs.rogue.laws import DETECTING
from cps_envs.rogue.noise import noise
from cps_envs.rogue.state import State

Row = NDArray[np.float64]
Rows = NDArray[np.void]
CENTRAL, LOCAL = 1_000, 1_000_000  # where the noise of the defender and of single vehicles is numbered from
PER_VEHICLE = 6
LAW_COLUMNS = DETECTING  # laws that a vehicle can be seen to drive by


@kernel
def time_left(log: Record, r: Record) -> float:
    """Time until the end of the episode, s."""
    return float((r.horizon_steps - log.step) * r.dt_s)


@kernel
def sense_sides(vehicles: Rows, i: int, entry: int, episode: Record, log: Record, r: Record, row: Row) -> None:
    """Fill row[:4] with gap error and gap rate ahead of and behind vehicle `i`; a side without neighbour stays."""
    for side in range(2):
        other = i + 1 if side == 0 else i - 1
        if 0 <= other < len(vehicles):
            ahead, behind = vehicles[max(i, other)], vehicles[min(i, other)]
            error = noise(r.range_noise_m, episode.noise_seed, log.step, entry + 2 * side)
            rate_error = noise(r.range_rate_noise_mps, episode.noise_seed, log.step, entry + 2 * side + 1)
            row[2 * side] = ahead.position - behind.position - r.separation_m + error
            row[2 * side + 1] = ahead.speed - behind.speed + rate_error


@kernel
def observe_attacker(state: State, rules: Rows, out: Row) -> None:
    """Fill `out` (B, size) with `attacker_fields`."""
    r = rules[0]
    out[:] = 0.0
    for b in range(out.shape[0]):
        vehicles, episode, log, row = state.vehicles[b], state.episode[b], state.log[b], out[b]
        sense_sides(vehicles, episode.attacker, 0, episode, log, r, row)
        row[4] = vehicles[episode.attacker].speed
        row[5] = log.effort
        row[6] = episode.reference_speed_mps
        row[7] = episode.attacker_drive_mps2 / episode.drive_mps2
        row[8] = episode.attacker + 1
        row[9] = max(episode.onset_step - log.step, 0) * r.dt_s
        row[10] = time_left(log, r)


@kernel
def observe_defender(state: State, rules: Rows, rear_watchers: int, modes: bool, out: Row) -> None:
    """Fill `out` (B, size) with `defender_fields`; `modes` tells whether `growth` and `law` are there."""
    r = rules[0]
    out[:] = 0.0
    for b in range(out.shape[0]):
        vehicles, episode, log, row = state.vehicles[b], state.episode[b], state.log[b], out[b]
        fill_platoon(vehicles, episode, log, r, row)
        end = fill_watch(vehicles, episode.attacker, rear_watchers, row, 4 * len(vehicles))
        if modes:
            end = fill_laws(vehicles, episode.attacker, row, end)
        row[end] = episode.attacker + 1
        row[end + 1] = time_left(log, r)


@kernel
def fill_platoon(vehicles: Rows, episode: Record, log: Record, r: Record, row: Row) -> None:
    """The entries up to and including `reference_speed`."""
    n, seed, now = len(vehicles), episode.noise_seed, log.step
    for i in range(n):
        me = vehicles[i]
        if i + 1 < n:
            ahead = vehicles[i + 1]
            error = noise(r.range_noise_m, seed, now, CENTRAL + i)
            rate_error = noise(r.range_rate_noise_mps, seed, now, CENTRAL + n + i)
            row[i] = ahead.position - me.position - r.separation_m + error
            row[n - 1 + i] = ahead.speed - me.speed + rate_error
        row[2 * n - 2 + i] = me.speed
        row[3 * n - 2 + i] = me.acceleration + noise(r.acceleration_noise_mps2, seed, now, CENTRAL + 2 * n + i)
    row[4 * n - 2] = reference_position(episode, log, r) - vehicles[n - 1].position
    row[4 * n - 1] = episode.reference_speed_mps


@kernel
def fill_watch(vehicles: Rows, seized: int, rear_watchers: int, row: Row, start: int) -> int:
    """Detectors and alarms of the intact vehicles from `start` on; returns where they end."""
    intact = len(vehicles) - 1
    rear = start + intact - 1
    alarm = rear + rear_watchers
    for k in range(intact):
        me = vehicles[k if k < seized else k + 1]
        if k < intact - 1:
            row[start + k] = me.front_detector
        if k >= intact - rear_watchers:
            row[rear + k - intact + rear_watchers] = me.rear_detector
        row[alarm + k] = me.alarm
    return alarm + intact


@kernel
def fill_laws(vehicles: Rows, seized: int, row: Row, start: int) -> int:
    """Growth and law of the intact vehicles from `start` on; returns where they end."""
    intact = len(vehicles) - 1
    laws = start + intact
    for k in range(intact):
        me = vehicles[k if k < seized else k + 1]
        row[start + k] = me.growth
        row[laws + LAW_COLUMNS * k + me.law] = 1.0
    return laws + LAW_COLUMNS * intact


@kernel
def observe_vehicles(state: State, rules: Rows, modes: bool, out: Row) -> None:
    """Fill `out` (B, n - 1, size) with `vehicle_fields`."""
    out[:] = 0.0
    for b in range(out.shape[0]):
        for k in range(out.shape[1]):
            i = k if k < state.episode[b].attacker else k + 1
            fill_vehicle(state.vehicles[b], i, state.episode[b], state.log[b], rules[0], modes, out[b, k])


@kernel
def fill_vehicle(vehicles: Rows, i: int, episode: Record, log: Record, r: Record, modes: bool, row: Row) -> None:
    """The own row of vehicle `i`."""
    me, leader, first = vehicles[i], len(vehicles) - 1, LOCAL + PER_VEHICLE * i
    row[0] = i == leader
    row[1] = i == 0
    sense_sides(vehicles, i, first, episode, log, r, row[2:6])
    if i == leader:
        row[2] = reference_position(episode, log, r) - me.position
        row[3] = episode.reference_speed_mps - me.speed
    row[6] = me.speed
    row[7] = episode.reference_speed_mps
    deviation, seed = r.acceleration_noise_mps2, episode.noise_seed
    if i < leader:
        row[8] = vehicles[i + 1].acceleration + noise(deviation, seed, log.step, first + 4)
    if i > 0:
        row[9] = vehicles[i - 1].acceleration + noise(deviation, seed, log.step, first + 5)
    row[10] = me.front_detector
    row[11] = me.rear_detector
    row[12] = me.alarm
    end = 13
    if modes:
        row[13] = me.growth
        row[14 + me.law] = 1.0
        end = 14 + LAW_COLUMNS
    row[end] = time_left(log, r)
