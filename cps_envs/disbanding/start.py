"""The start of episodes: what is drawn for them, and the steady state (specification 2.6), optionally perturbed."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, clip, fill, inlined, kernel, pack, room, unpack, view
from cps_envs.core.compute.streams import between, uniform, whole
from cps_envs.core.declare.bodies import names_each, spans
from cps_envs.core.declare.config import bounds
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.disbanding.config import OF_VEHICLES, DisbandingConfig
from cps_envs.disbanding.state import Constants, State

MIN_SPEED_MPS = 0.0  # Table 2.1: v_min
RIDE_S = 0.1  # between two notes of the ride; chosen: passengers hardly feel what is faster


class Perturbation(NamedTuple):
    """How a start differs from the steady state, for each vehicle; absent vehicles are ignored."""

    gap_factor: FloatArray  # (B, M) multiplies the steady gap: x_d inside a platoon, h v_d ahead of a leader
    speed_offset_mps: FloatArray  # (B, M) is added to v_d and limited to the speed range
    takeover_delay_s: FloatArray  # (B, M) of each human driver
    driver_headway_s: FloatArray  # (B, M) of each human driver


class Spread(NamedTuple):
    """The interval from which a vehicle's row of `Perturbation` is drawn, as its lower end and its width."""

    low: FloatArray  # (4,)
    width: FloatArray  # (4,)


def undisturbed(constants: Array, num_vehicles: int) -> Perturbation:
    """The steady state with drivers who take over at once and keep the leaders' headway h; `constants` is (B,)."""
    shape = (len(constants), num_vehicles)
    headways = np.broadcast_to(constants["headway_s"][:, np.newaxis], shape)
    return Perturbation(np.ones(shape), np.zeros(shape), np.zeros(shape), headways.copy())


def nominal_constants(config: DisbandingConfig) -> Constants:
    """What is publicly known of every episode; drawn quantities stand at the middle, and N at the end, of their range.

    Of a configuration that leaves nothing to chance these are the constants of every episode.
    """
    known = vars(config) | vars(config.dynamics) | {"num_vehicles": config.max_vehicles, "min_speed_mps": MIN_SPEED_MPS}
    known["stop_at_collision"] = config.on_collision == "end"
    known |= {name: sum(bounds(getattr(config, name))) / 2 for name in ("desired_gap_m", "hop_loss")}
    known |= {name: float(spans(getattr(config, name)).mean(axis=0).mean()) for name in OF_VEHICLES}
    known["corrects_all"], known["relayed"] = config.correctable == "intact", config.is_relayed
    known["hop_steps"] = whole_steps(sum(bounds(config.hop_delay_s)) / 2, config.dynamics.dt_s)
    known["noise_width_mps2"] = math.sqrt(3.0) * config.correction_noise_mps2  # uniform, of that deviation
    known["noise_steps"] = config.periods_per_second * config.steps_per_period  # 1 s, chosen
    known["period_steps"] = config.steps_per_period
    known["jolt_mps2"] = config.jolt_mps2 if config.attack == "jolt" else 0.0
    known["ride_steps"] = whole_steps(RIDE_S, config.dynamics.dt_s) if config.report == "full" else 0
    return Constants(**{name: known[name] for name in Constants._fields})


def whole_steps(time_s: float, dt_s: float) -> int:
    """Integration steps in a time (s), at least one."""
    return max(1, round(time_s / dt_s))


def spread(config: DisbandingConfig) -> Spread:
    """How far the vehicles of an episode may differ."""
    ends = np.array(
        [
            (-config.gap_spread, config.gap_spread),
            (-config.speed_spread_mps, config.speed_spread_mps),
            bounds(config.takeover_delay_s),
            bounds(config.driver_headway_s),
        ],
        np.float64,
    )
    return Spread(ends[:, 0].copy(), ends[:, 1] - ends[:, 0])


class Chances(NamedTuple):
    """The intervals from which the numbers of a whole episode are drawn; nothing is drawn where one is exact."""

    fewest_platoons: int
    most_platoons: int
    least_tau_s: float
    most_tau_s: float
    least_gap_m: float
    most_gap_m: float
    least_budget: int
    most_budget: int


def chances_of(config: DisbandingConfig) -> Array:
    """The chances of a configuration as records (1,)."""
    lag = bounds(config.tau_s) if not names_each(config.tau_s) else nominal_constants(config).tau_s
    drawn = (config.num_platoons, lag, config.desired_gap_m, config.attack_budget)
    ends: list[Any] = [end for value in drawn for end in bounds(value)]
    return pack(Chances(*ends))


class Builds(NamedTuple):
    """How lag and gains of the vehicles may differ, in the order of `config.OF_VEHICLES`; m is M, or 1 if all share."""

    low: FloatArray  # (3, m)
    width: FloatArray  # (3, m) of the intervals that are drawn from; nothing is drawn where it is 0
    each: BoolArray  # (3,) whether every vehicle has its own


def builds_of(config: DisbandingConfig) -> Builds:
    """The vehicles of a configuration; a common lag is drawn with the `Chances`."""
    values = [getattr(config, name) for name in OF_VEHICLES]
    shape = (len(values), config.max_vehicles if config.differ else 1)
    low, width = np.zeros(shape), np.zeros(shape)
    for k, value in enumerate(values):
        ends = spans(value)
        low[k], width[k] = ends[0], ends[1] - ends[0]
    return Builds(low, width, np.array([names_each(value) for value in values]))


@inlined
def build(stream: Array, episode: State, own: Record, builds: Builds) -> None:
    """Draw common gains, and lag and gains of vehicles that have their own; the lag of `own` is then their mean."""
    if builds.width[1, 0] > 0.0 and not builds.each[1]:
        own.proportional_gain = builds.low[1, 0] + builds.width[1, 0] * uniform(stream)
    if builds.width[2, 0] > 0.0 and not builds.each[2]:
        own.derivative_gain = builds.low[2, 0] + builds.width[2, 0] * uniform(stream)
    vehicles = (episode.tau_s, episode.proportional_gain, episode.derivative_gain)
    common = (own.tau_s, own.proportional_gain, own.derivative_gain)
    for k in range(3):
        for q in range(vehicles[k].size):
            value = common[k]
            if builds.each[k]:
                value = builds.low[k, q]
                if builds.width[k, q] > 0.0:
                    value += builds.width[k, q] * uniform(stream)
            vehicles[k][q] = value
    if builds.each[0]:
        total = 0.0
        for q in range(own.num_vehicles):
            total += episode.tau_s[q]
        own.tau_s = total / own.num_vehicles


@kernel
def start_drawn(
    state: State,
    constants: Array,
    budget: IntArray,
    streams: Array,
    envs: BoolArray,
    chances: Array,
    limits: Spread,
    builds: Builds,
) -> None:
    """Draw the marked environments (B,) from their streams (B, 6) and put them at time 0.

    What the configuration leaves exact is drawn too, so that the order of the draws is always the same: platoons, lag,
    desired gap, budget (B,), vehicles.
    """
    chance, rows = unpack(Chances, chances, 0), room((4, state.position.shape[1]))
    for b in range(envs.size):
        if envs[b]:
            stream, own = borrowed(streams)[b], constants[b]
            platoons = whole(stream, chance.fewest_platoons, chance.most_platoons + 1)
            own.num_vehicles = platoons * own.vehicles_per_platoon
            own.tau_s = between(stream, chance.least_tau_s, chance.most_tau_s)
            own.desired_gap_m = between(stream, chance.least_gap_m, chance.most_gap_m)
            budget[b] = whole(stream, chance.least_budget, chance.most_budget + 1)
            for k in range(4):
                for q in range(rows.shape[1]):
                    rows[k, q] = limits.low[k] + limits.width[k] * uniform(stream)
            build(stream, view(state, b), own, builds)
            place_episode(view(state, b), unpack(Constants, constants, b), perturbed(borrowed(rows)))


@inlined
def perturbed(rows: FloatArray) -> Perturbation:
    """A perturbation of rows (4, M); the first one becomes a factor."""
    for q in range(rows.shape[1]):
        rows[0, q] = 1.0 + rows[0, q]
    return Perturbation(rows[0], rows[1], rows[2], rows[3])


@kernel
def place(state: State, constants: Array, perturbation: Perturbation, envs: BoolArray) -> None:
    """Put the marked environments (B,) at time 0: all platoons intact, everything that is counted cleared."""
    for b in range(envs.size):
        if envs[b]:
            place_episode(view(state, b), unpack(Constants, constants, b), view(perturbation, b))


@inlined
def place_episode(episode: State, c: Constants, perturbation: Perturbation) -> None:
    """`place` for one episode; the perturbation's rows are (M,)."""
    clear(episode)
    desired_speed, place_m = c.desired_speed_mps, 0.0
    for q in range(c.num_vehicles):
        gap = c.headway_s * desired_speed if q % c.vehicles_per_platoon == 0 else c.desired_gap_m
        place_m += (gap if q > 0 else 0.0) * perturbation.gap_factor[q]
        episode.position[q] = -place_m
        episode.speed[q] = clip(desired_speed + perturbation.speed_offset_mps[q], c.min_speed_mps, c.max_speed_mps)
        episode.takeover_delay_s[q] = perturbation.takeover_delay_s[q]
        episode.driver_headway_s[q] = perturbation.driver_headway_s[q]


@inlined
def clear(episode: State) -> None:
    """Zero everything, for absent vehicles too, and write what stands for "not yet"."""
    episode.step[0] = 0
    episode.intact_error[0] = 0.0
    episode.first_collision_s[0] = -1.0
    fill(episode.disbanding_s, np.inf)
    for q in range(episode.position.size):
        episode.position[q] = episode.speed[q] = episode.acceleration[q] = episode.command[q] = 0.0
        episode.takeover_delay_s[q] = episode.driver_headway_s[q] = episode.speed_error[q] = 0.0
        episode.previous_gap[q] = np.inf
        episode.rear_collided[q] = episode.collided[q] = episode.collided_intact[q] = False
        episode.stops[q] = 0
        episode.moving[q] = True
    clear_elements(episode)


@inlined
def clear_elements(episode: State) -> None:
    """What `clear` does to the elements that `circumstances` draws and `radio` moves."""
    episode.opening_s[0] = episode.false_alarms[0] = 0.0
    episode.attacked_s[0], episode.attacked_member[0] = -np.inf, 1
    for drivers in (episode.jolted_until_s, episode.reaction_s, episode.felt_mps2):
        fill(drivers, 0.0)
    for limits in (episode.alarming_braking_mps2, episode.alarming_jerk_mps3, episode.alarming_gap_m):
        fill(limits, 0.0)
    episode.jam_place[0], episode.jam_steps[0] = -1, 0
    episode.smallest_gap[0] = np.inf
    episode.noted[0] = 0
    episode.acceleration_squares[0] = episode.jerk_squares[0] = 0.0
    episode.work_kj[0] = episode.driven_km[0] = episode.disturbed_s[0] = 0.0
    for q in range(episode.record_s.size):
        episode.braking_s[q] = episode.braking_mps2[q] = episode.noise_mps2[q] = 0.0
        episode.noted_acceleration[q] = 0.0
        episode.record_s[q], episode.heard_s[q] = np.inf, 0.0
        episode.record_position[q] = episode.record_speed[q] = 0.0
        episode.record_acceleration[q] = episode.record_command[q] = 0.0
