"""The state of a batch of platoons, what an episode draws, and what all episodes of a game share."""

from __future__ import annotations

from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import inlined, pack, view
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.rogue.config import RogueConfig

FULL_TURN = 6.283185307179586
NEVER = 1 << 40  # integration steps


class State(NamedTuple):
    """B episodes of n vehicles from the rear (0) to the leader (n - 1); pair i is vehicle i and the one ahead of it."""

    position: FloatArray  # (B, n) m, of the centre
    speed: FloatArray  # (B, n) m/s
    acceleration: FloatArray  # (B, n) m/s2 in the last integration step, without impulses of contact
    effort: FloatArray  # (B, n) in the last integration step, from F- to F+
    front_detector: FloatArray  # (B, n) m2/s3, z of the front side; zero for the seized vehicle
    rear_detector: FloatArray  # (B, n) m2/s3, z of the rear side; zero for the seized vehicle
    growth: FloatArray  # (B, n) m, separation set-point minus sigma
    alarm: IntArray  # (B, n) 1 once the front neighbour has been detected, -1 the rear one, 0 none
    controller: IntArray  # (B, n) by which a vehicle drove last, see `controllers`
    damage: FloatArray  # (B, n - 1) of each pair, m (contact "pass") or m/s ("solid")
    collisions: IntArray  # (B, n - 1) how often the pair came into contact
    armed: BoolArray  # (B, n - 1) a contact would count as a new one
    step: IntArray  # (B,) integration steps done; the time is step * dt
    held_effort: FloatArray  # (B, n) that the attacker decided last for each seized vehicle; zero for the others
    rogue: BoolArray  # (B, n) the seized vehicles
    drive_mps2: FloatArray  # (B, m) alpha of each vehicle; m is n, or 1 where all are alike
    drag_per_s: FloatArray  # (B, m) beta
    length_m: FloatArray  # (B, m) l
    proportional_gain: FloatArray  # (B, m) k_p, 1/s2
    derivative_gain: FloatArray  # (B, m) k_d, 1/s
    place: IntArray  # (B,) where in the leader's series the episode began, in control periods


class Drawn(NamedTuple):
    """What an episode draws at its start; a reference that follows a series moves on with it."""

    attacker: int  # the seized vehicle, 0 = rear; of several the rearmost
    drive_mps2: float  # alpha of that vehicle's engine as it was built
    attacker_drive_mps2: float  # alpha that the attacker gets out of it
    drag_per_s: float  # beta of that vehicle
    reference_speed_mps: float  # v_ref
    reference_start_m: float  # x_ref now minus v_ref times the time: at time 0, if v_ref stays the same
    onset_step: int  # integration step from which on the attacker drives; `NEVER` in an episode without an attack
    noise_seed: int
    num_vehicles: int  # of the platoon; the arrays of `State` may be longer


class Rules(NamedTuple):
    """What is the same in every episode of a game."""

    dt_s: float
    steps_per_period: int  # integration steps in a game step
    hold_steps: int  # integration steps between two decisions of the attacker
    horizon_steps: int  # integration steps in an episode
    min_effort: float  # F-
    max_effort: float  # F+
    separation_m: float  # sigma, between centres
    surface_slope_per_s: float  # k_1
    boundary_layer_mps: float  # epsilon
    surface_gain_mps2: float  # 2 k_1 v_max
    max_acceleration_mps2: float  # a_max
    alarm_threshold: float  # l_1, m2/s3
    leak_per_s: float  # 2 pi f_cutoff
    outer_share: float  # n_1
    middle_share: float  # n_2
    inner_share: float  # n_3
    growth_step_m: float
    growth_steps: int  # integration steps between two growths, t_inc
    max_growth_m: float
    driver_acceleration_mps2: float  # a of (2.5)
    driver_braking_mps2: float  # b of (2.5)
    driver_headway_s: float  # h of (2.5)
    driver_gap_m: float  # r_0 of (2.5)
    human_returns: bool
    solid: bool
    bumper_mps: float  # impact speed that does no damage
    spacing_spread_m: float  # initial separations +- this
    speed_spread_mps: float  # initial speeds +- this
    logarithmic: bool  # the formation cost is the logarithm of the distance from the places
    open_places: bool  # and nobody has a place beyond the seized vehicle
    cycles: bool  # the reference speed follows a series
    hidden: bool  # the seized vehicle gets orders too, and obeys until the onset
    formation_weight_mps2: float  # w
    range_noise_m: float
    range_rate_noise_mps: float
    speed_noise_mps: float
    acceleration_noise_mps2: float


@inlined
def platoon(state: State, b: int, num_vehicles: int) -> State:
    """Environment `b` without the places of vehicles that its platoon does not have."""
    n, episode = num_vehicles, view(state, b)
    return State(
        position=episode.position[:n],
        speed=episode.speed[:n],
        acceleration=episode.acceleration[:n],
        effort=episode.effort[:n],
        front_detector=episode.front_detector[:n],
        rear_detector=episode.rear_detector[:n],
        growth=episode.growth[:n],
        alarm=episode.alarm[:n],
        controller=episode.controller[:n],
        damage=episode.damage[: n - 1],
        collisions=episode.collisions[: n - 1],
        armed=episode.armed[: n - 1],
        step=episode.step,
        held_effort=episode.held_effort[:n],
        rogue=episode.rogue[:n],
        drive_mps2=episode.drive_mps2,
        drag_per_s=episode.drag_per_s,
        length_m=episode.length_m,
        proportional_gain=episode.proportional_gain,
        derivative_gain=episode.derivative_gain,
        place=episode.place,
    )


@inlined
def of_vehicle(values: FloatArray, i: int) -> float:
    """The value (m,) of vehicle `i`, which is that of all where all are alike."""
    return float(values[min(i, values.size - 1)])


@inlined
def touching_m(episode: State, i: int) -> float:
    """Between the centres of pair `i` in contact, m."""
    return 0.5 * (of_vehicle(episode.length_m, i) + of_vehicle(episode.length_m, i + 1))


def allocate(num_envs: int, num_vehicles: int, num_bodies: int = 1) -> State:
    """A state with everything zero; `start.start_episodes` fills it."""
    vehicles, pairs, bodies = (num_envs, num_vehicles), (num_envs, num_vehicles - 1), (num_envs, num_bodies)
    return State(
        position=np.zeros(vehicles),
        speed=np.zeros(vehicles),
        acceleration=np.zeros(vehicles),
        effort=np.zeros(vehicles),
        front_detector=np.zeros(vehicles),
        rear_detector=np.zeros(vehicles),
        growth=np.zeros(vehicles),
        alarm=np.zeros(vehicles, np.int64),
        controller=np.zeros(vehicles, np.int64),
        damage=np.zeros(pairs),
        collisions=np.zeros(pairs, np.int64),
        armed=np.zeros(pairs, np.bool_),
        step=np.zeros(num_envs, np.int64),
        held_effort=np.zeros(vehicles),
        rogue=np.zeros(vehicles, np.bool_),
        drive_mps2=np.zeros(bodies),
        drag_per_s=np.zeros(bodies),
        length_m=np.zeros(bodies),
        proportional_gain=np.zeros(bodies),
        derivative_gain=np.zeros(bodies),
        place=np.zeros(num_envs, np.int64),
    )


def rules_of(config: RogueConfig) -> Array:
    """The rules of a configuration as records (1,)."""
    derived = {
        "steps_per_period": config.steps_per_period,
        "hold_steps": round(config.attack_hold_s / config.dt_s),
        "horizon_steps": round(config.duration_s / config.dt_s),
        "surface_gain_mps2": 2 * config.surface_slope_per_s * config.max_speed_mps,
        "leak_per_s": FULL_TURN * config.detector_cutoff_hz,
        "growth_steps": round(config.growth_interval_s / config.dt_s),
        "solid": config.contact == "solid",
        "logarithmic": config.formation_cost != "scattering",
        "open_places": config.formation_cost == "open_place",
        "cycles": config.has_cycle,
        "hidden": config.hidden,
    }
    known = asdict(config) | derived
    return pack(Rules(**{name: known[name] for name in Rules._fields}))
