"""What the attacker, the central defender, and a single vehicle of the swarm form observe: fields and kernels."""

from __future__ import annotations

import numpy as np

from cps_envs.core.config import bounds
from cps_envs.core.fields import Field, Fields, encode_row
from cps_envs.core.kernels import Record, borrowed, fill, inlined, kernel, unpack, view
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import DRIVEN
from cps_envs.rogue.formation import FAR, reference_position
from cps_envs.rogue.noise import noise
from cps_envs.rogue.state import Drawn, Rules, State

RATE_MPS = 25.0
MAX_SPEED_MPS = 100.0  # what the paper's engine can hold at twice the power
ACCELERATION_MPS2 = 10.0
MAX_REFERENCE_MPS = 60.0
MAX_RATIO = 3.0
MAX_ONSET_S = 60.0
DETECTOR_SPAN = 3.0  # alarm thresholds
CENTRAL, LOCAL = 1_000, 1_000_000  # where the noise of the defender and of single vehicles is numbered from
PER_VEHICLE = 6


def attacker_fields(config: RogueConfig) -> Fields:
    """The seized vehicle's own sensors; a side without a neighbour reads zero."""
    far = FAR * config.separation_m
    return Fields(
        Field("front_gap_error", "m", -far, far, (), "distance to the vehicle ahead minus sigma"),
        Field("front_gap_rate", "m/s", -RATE_MPS, RATE_MPS, (), "speed of the vehicle ahead minus own"),
        Field("rear_gap_error", "m", -far, far, (), "distance to the vehicle behind minus sigma"),
        Field("rear_gap_rate", "m/s", -RATE_MPS, RATE_MPS, (), "own speed minus that of the vehicle behind"),
        Field("speed", "m/s", 0, MAX_SPEED_MPS, (), "own"),
        Field("effort", "-", config.min_effort, config.max_effort, (), "own, in the last integration step"),
        Field("reference_speed", "m/s", 0, MAX_REFERENCE_MPS, (), "v_ref"),
        Field("power_ratio", "-", 1, MAX_RATIO, (), "own alpha over that of the others"),
        Field("attacker_index", "-", 1, config.num_vehicles, (), "of the seized vehicle, 1 = rear"),
        Field("until_onset_s", "s", 0, MAX_ONSET_S, (), "until the own effort takes effect"),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
    )


def watches_rear(config: RogueConfig) -> int:
    """Number of intact vehicles that may have somebody behind them; the others come first."""
    return config.num_intact - (bounds(config.attacker_index)[0] > 1)


def defender_fields(config: RogueConfig) -> Fields:
    """Pairs and vehicles from the rear to the leader; `intact` vehicles are those without the seized one.

    Pair i is vehicle i and the one ahead of it. The last intact vehicle is the leader: it has no front detector. Unless
    the rear vehicle can be the seized one, the first intact vehicle is the rear one: it has no rear detector.
    """
    n, intact, far = config.num_vehicles, config.num_intact, FAR * config.separation_m
    spread = DETECTOR_SPAN * config.alarm_threshold
    growths, laws = ((intact,), (intact, len(DRIVEN))) if config.defense_action == "mode" else ((0,), (0,))
    return Fields(
        Field("gap_error", "m", -far, far, (n - 1,), "of each pair, distance minus sigma"),
        Field("gap_rate", "m/s", -RATE_MPS, RATE_MPS, (n - 1,), "of each pair"),
        Field("speed", "m/s", 0, MAX_SPEED_MPS, (n,), "of each vehicle"),
        Field("acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (n,), "of each vehicle"),
        Field("reference_error", "m", -far, far, (), "reference minus the leader's position"),
        Field("reference_speed", "m/s", 0, MAX_REFERENCE_MPS, (), "v_ref"),
        Field("front_detector", "m2/s3", 0, spread, (intact - 1,), "z_f of the intact vehicles but the leader"),
        Field("rear_detector", "m2/s3", 0, spread, (watches_rear(config),), "z_r of those with somebody behind"),
        Field("alarm", "-", -1, 1, (intact,), "1: front neighbour detected, -1: rear one, 0: none; latched"),
        Field("growth", "m", 0, config.max_growth_m, growths, "separation set-point minus sigma"),
        Field("law", "-", 0, 1, laws, f"law in force, one-hot: {', '.join(DRIVEN)}"),
        Field("attacker_index", "-", 1, n, (), "of the seized vehicle, 1 = rear"),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
    )


def vehicle_fields(config: RogueConfig) -> Fields:
    """The own row of one intact vehicle in the swarm form: its own sensors and its own detectors."""
    far, spread = FAR * config.separation_m, DETECTOR_SPAN * config.alarm_threshold
    growths, laws = ((), (len(DRIVEN),)) if config.defense_action == "mode" else ((0,), (0,))
    return Fields(
        Field("leads", "-", 0, 1, (), "the vehicle is the leader, whose front neighbour is the reference"),
        Field("trails", "-", 0, 1, (), "nobody is behind"),
        Field("front_gap_error", "m", -far, far, (), "distance ahead minus sigma; the leader's to its reference"),
        Field("front_gap_rate", "m/s", -RATE_MPS, RATE_MPS, (), "speed ahead minus own; the leader's to v_ref"),
        Field("rear_gap_error", "m", -far, far, (), "distance behind minus sigma; 0 if nobody is behind"),
        Field("rear_gap_rate", "m/s", -RATE_MPS, RATE_MPS, (), "own speed minus that behind; 0 if nobody is behind"),
        Field("speed", "m/s", 0, MAX_SPEED_MPS, (), "own"),
        Field("reference_speed", "m/s", 0, MAX_REFERENCE_MPS, (), "v_ref"),
        Field("front_acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (), "ahead; 0 for the leader"),
        Field("rear_acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (), "behind; 0 if nobody is"),
        Field("front_detector", "m2/s3", 0, spread, (), "own z_f"),
        Field("rear_detector", "m2/s3", 0, spread, (), "own z_r"),
        Field("alarm", "-", -1, 1, (), "1: front neighbour detected, -1: rear one, 0: none; latched"),
        Field("growth", "m", 0, config.max_growth_m, growths, "own separation set-point minus sigma"),
        Field("law", "-", 0, 1, laws, f"own law in force, one-hot: {', '.join(DRIVEN)}"),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
    )


@kernel
def observe_attacker(
    state: State, drawn: Array, rules: Array, offsets: Array, scale: FloatArray, encoded: Observation
) -> None:
    """Fill `encoded` (B, size) with `attacker_fields`."""
    r, at, row = unpack(Rules, rules, 0), borrowed(offsets)[0], np.empty(scale.shape[1])
    for b in range(encoded.shape[0]):
        episode, c = view(state, b), unpack(Drawn, drawn, b)
        fill(row, 0.0)
        sense_sides(episode, c.attacker, 0, c, r, at, row)
        row[at.speed] = episode.speed[c.attacker]
        row[at.effort] = episode.effort[c.attacker]
        row[at.reference_speed] = c.reference_speed_mps
        row[at.power_ratio] = c.attacker_drive_mps2 / c.drive_mps2
        row[at.attacker_index] = c.attacker + 1
        row[at.until_onset_s] = max(c.onset_step - episode.step[0], 0) * r.dt_s
        row[at.time_left_s] = time_left(episode, r)
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])


@kernel
def observe_defender(
    state: State, drawn: Array, rules: Array, offsets: Array, scale: FloatArray, encoded: Observation
) -> None:
    """Fill `encoded` (B, size) with `defender_fields`."""
    r, at, row = unpack(Rules, rules, 0), borrowed(offsets)[0], np.empty(scale.shape[1])
    for b in range(encoded.shape[0]):
        episode, c = view(state, b), unpack(Drawn, drawn, b)
        fill(row, 0.0)
        fill_platoon(episode, c, r, at, row)
        fill_intact(episode, c, at, row)
        row[at.attacker_index] = c.attacker + 1
        row[at.time_left_s] = time_left(episode, r)
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])


@kernel
def observe_vehicles(
    state: State, drawn: Array, rules: Array, offsets: Array, scale: FloatArray, encoded: Observation
) -> None:
    """Fill `encoded` (B, n - 1, size) with `vehicle_fields`."""
    r, at, row = unpack(Rules, rules, 0), borrowed(offsets)[0], np.empty(scale.shape[1])
    for b in range(encoded.shape[0]):
        episode, c = view(state, b), unpack(Drawn, drawn, b)
        for k in range(encoded.shape[1]):
            fill(row, 0.0)
            fill_vehicle(episode, k + (k >= c.attacker), c, r, at, row)
            encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b, k])


@inlined
def time_left(episode: State, r: Rules) -> float:
    """Time until the end of the episode, s."""
    return float((r.horizon_steps - episode.step[0]) * r.dt_s)


@inlined
def sense_sides(episode: State, i: int, entry: int, c: Drawn, r: Rules, at: Record, row: FloatArray) -> None:
    """Gap errors and gap rates ahead of and behind vehicle `i`, with noise numbered from `entry` on."""
    x, v, seed, now = episode.position, episode.speed, c.noise_seed, episode.step[0]
    if i + 1 < x.size:
        row[at.front_gap_error] = x[i + 1] - x[i] - r.separation_m + noise(r.range_noise_m, seed, now, entry)
        row[at.front_gap_rate] = v[i + 1] - v[i] + noise(r.range_rate_noise_mps, seed, now, entry + 1)
    if i > 0:
        row[at.rear_gap_error] = x[i] - x[i - 1] - r.separation_m + noise(r.range_noise_m, seed, now, entry + 2)
        row[at.rear_gap_rate] = v[i] - v[i - 1] + noise(r.range_rate_noise_mps, seed, now, entry + 3)


@inlined
def fill_platoon(episode: State, c: Drawn, r: Rules, at: Record, row: FloatArray) -> None:
    """What is seen of pairs and vehicles, and of the leader's reference."""
    x, v, seed, now, n = episode.position, episode.speed, c.noise_seed, episode.step[0], episode.speed.size
    for i in range(n - 1):
        error = noise(r.range_noise_m, seed, now, CENTRAL + i)
        row[at.gap_error + i] = x[i + 1] - x[i] - r.separation_m + error
        row[at.gap_rate + i] = v[i + 1] - v[i] + noise(r.range_rate_noise_mps, seed, now, CENTRAL + n + i)
    for i in range(n):
        row[at.speed + i] = v[i]
        error = noise(r.acceleration_noise_mps2, seed, now, CENTRAL + 2 * n + i)
        row[at.acceleration + i] = episode.acceleration[i] + error
    row[at.reference_error] = reference_position(episode, c, r) - x[n - 1]
    row[at.reference_speed] = c.reference_speed_mps


@inlined
def fill_intact(episode: State, c: Drawn, at: Record, row: FloatArray) -> None:
    """Detectors, alarms, growths and controllers of the intact vehicles, as far as there are fields for them."""
    intact, rear = episode.armed.size, at.rear_detector
    unwatched = intact - (at.alarm - rear)  # vehicles from the rear on that can have nobody behind
    for k in range(intact):
        i = k + (k >= c.attacker)
        if k < intact - 1:
            row[at.front_detector + k] = episode.front_detector[i]
        if k >= unwatched:
            row[rear + k - unwatched] = episode.rear_detector[i]
        row[at.alarm + k] = episode.alarm[i]
        if at.law > at.growth:
            row[at.growth + k] = episode.growth[i]
            row[at.law + len(DRIVEN) * k + episode.controller[i]] = 1.0


@inlined
def fill_vehicle(episode: State, i: int, c: Drawn, r: Rules, at: Record, row: FloatArray) -> None:
    """The own row of vehicle `i`."""
    leader, entry, deviation = episode.speed.size - 1, LOCAL + PER_VEHICLE * i, r.acceleration_noise_mps2
    sense_sides(episode, i, entry, c, r, at, row)
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
        row[at.law + episode.controller[i]] = 1.0
    row[at.time_left_s] = time_left(episode, r)
