"""What kernels know of a batch of strings of platoons: the state, which they change in place, and the constants."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray


class State(NamedTuple):
    """B environments with N platoons of n vehicles, M = N * n in all; `kernels.view` cuts one out, an `episode`.

    Vehicles are numbered front to rear along the string: q = 0 is the front vehicle, q - 1 the predecessor of q, and
    platoon p = q // n, also counted from the front (the paper's platoon index is N - p).
    """

    step: IntArray  # (B,) integration steps done; the time is step * dt
    position: FloatArray  # (B, M) m
    speed: FloatArray  # (B, M) m/s
    acceleration: FloatArray  # (B, M) m/s2
    command: FloatArray  # (B, M) m/s2, final commanded acceleration of the last step
    previous_gap: FloatArray  # (B, M) m, gap ahead at the step before; +inf at the start and for q = 0
    disbanding_s: FloatArray  # (B, N) s, when each platoon is disbanded; +inf while intact
    takeover_delay_s: FloatArray  # (B, M) s between disbanding and the driver's taking over
    driver_headway_s: FloatArray  # (B, M) s, time headway of each human driver
    speed_error: FloatArray  # (B, M) m/s, sum over the steps of |v - v_d|
    intact_error: FloatArray  # (B,) m/s, sum over the steps of the mean |v - v_d| of the vehicles intact then
    rear_collided: BoolArray  # (B, M) the gap ahead was <= 0 at some time
    collided: BoolArray  # (B, M) involved in a collision: rear_collided, or the predecessor of such a vehicle
    collided_intact: BoolArray  # (B, M) became involved while its platoon was intact
    first_collision_s: FloatArray  # (B,) s, -1 while there is none
    stops: IntArray  # (B, M) number of stops (speed below 0.01 m/s, re-armed above 1 m/s)
    moving: BoolArray  # (B, M) a further stop would count
    braking_s: FloatArray  # (B, M) s, how long each driver brakes on taking over; 0 for most
    braking_mps2: FloatArray  # (B, M) m/s2, how hard
    noise_mps2: FloatArray  # (B, M) m/s2, what each actuator adds to a correction now
    record_s: FloatArray  # (B, M) s, when the record that a vehicle has received was taken; +inf while it has none
    record_position: FloatArray  # (B, M) m, of the disbanded vehicle in that record
    record_speed: FloatArray  # (B, M) m/s
    record_acceleration: FloatArray  # (B, M) m/s2
    record_command: FloatArray  # (B, M) m/s2
    heard_s: FloatArray  # (B, M) s, when a message of the vehicle ahead last came through; 0 at the start
    opening_s: FloatArray  # (B,) s, the attacker cannot act before
    jam_place: IntArray  # (B,) the platoon, counted from the front, behind which the radio is blocked; -1 if none
    jam_steps: IntArray  # (B,) integration steps of jamming left
    smallest_gap: FloatArray  # (B,) m, ahead of an intact vehicle so far, seen at the control periods
    false_alarms: FloatArray  # (B,) sum over the control periods of the share of vehicles corrected without a reason
    noted_acceleration: FloatArray  # (B, M) m/s2, when the ride was noted last, see `ride`
    noted: IntArray  # (B,) how often it was noted, summed over the vehicles
    acceleration_squares: FloatArray  # (B,) m2/s4, their sum
    jerk_squares: FloatArray  # (B,) m2/s6, their sum
    work_kj: FloatArray  # (B,) kJ, traction of all vehicles noted
    driven_km: FloatArray  # (B,) km, their distance
    disturbed_s: FloatArray  # (B,) s, when an intact vehicle was last seen off the desired speed after an attack
    tau_s: FloatArray  # (B, M) actuation lag of each vehicle; (B, 0) where all have that of `Constants`
    proportional_gain: FloatArray  # (B, M) 1/s2, likewise
    derivative_gain: FloatArray  # (B, M) 1/s, likewise
    attacked_s: FloatArray  # (B,) s, when the attacker last attacked; -inf before
    attacked_member: IntArray  # (B,) which vehicle of a platoon it jolts, 1 = the leader
    jolted_until_s: FloatArray  # (B, M) s, a false reading makes the vehicle brake; (B, 0) where nobody is jolted
    alarming_braking_mps2: FloatArray  # (B, M) at which each driver takes over; (B, 0) where no driver watches
    alarming_jerk_mps3: FloatArray  # (B, M) likewise
    alarming_gap_m: FloatArray  # (B, M) likewise, below it
    reaction_s: FloatArray  # (B, M) s, from the alarm to taking over
    felt_mps2: FloatArray  # (B, M) m/s2, the acceleration when the driver last looked
    chance: Array  # (B, 4) uint64, the stream of what is drawn on the way, see `core.compute.streams`


class Constants(NamedTuple):
    """The numbers of one episode; a batch has them as `core.compute.kernels.records`, (B,)."""

    num_vehicles: int  # M of this episode; vehicles q >= num_vehicles of the arrays are absent
    vehicles_per_platoon: int  # n
    dt_s: float  # integration step
    tau_s: float  # actuation lag, (2.1); where vehicles differ the mean
    desired_gap_m: float  # x_d
    headway_s: float  # h of the platoon leaders, (2.4)
    proportional_gain: float  # k_p, 1/s2
    derivative_gain: float  # k_d, 1/s
    desired_speed_mps: float  # v_d
    min_speed_mps: float  # v_min
    max_speed_mps: float  # v_max
    min_acceleration_mps2: float  # u_min
    max_acceleration_mps2: float  # u_max
    standstill_gap_m: float  # r_0
    exact_integration: bool  # zero-order hold of (2.1) instead of explicit Euler
    saturate_command: bool  # clip the commands of intact and human vehicles to [u_min, u_max]
    one_sided_avoidance: bool  # (2.6) with max(0, v^2 - v_p^2)
    transitional_controller: bool  # leaders brake early when they close in
    inelastic_contact: bool  # vehicles that touch stay behind one another instead of passing as ghosts
    standstill_rule: bool  # who is nearer than r_0 to the vehicle ahead cannot move
    stop_at_collision: bool  # the episode stands still from the first collision of an intact vehicle on
    attack_pause_s: float  # between two attacks, at least
    corrects_all: bool  # corrections act on every intact vehicle, not only upstream of a disbanded platoon
    relayed: bool  # the warning travels from vehicle to vehicle
    hop_steps: int  # integration steps between two messages of a vehicle
    hop_loss: float  # share of the messages that are lost
    noise_width_mps2: float  # what an actuator adds to a correction lies within +- this
    full_correction_mps2: float  # from this size on the rule of corrections applies in full; 0: see `corrected`
    noise_steps: int  # integration steps for which an actuator's noise holds
    period_steps: int  # integration steps in a control period
    ride_steps: int  # integration steps between two notes of the ride; 0 where it is not noted
    jolt_mps2: float  # how hard a jolted vehicle brakes; 0 where the attacker disbands platoons by a message
    jolt_s: float  # and for how long


def allocate(
    num_envs: int,
    num_platoons: int,
    vehicles_per_platoon: int,
    *,
    differ: bool = False,
    jolts: bool = False,
    watchful: bool = False,
) -> State:
    """A state with every array zero; `start.place` fills the episodes.

    Vehicles may `differ`, in lag and gains, the attacker may have `jolts`, and drivers may be `watchful`.
    """
    envs, vehicles = num_envs, num_platoons * vehicles_per_platoon
    own, jolted, driver = ((envs, vehicles if there else 0) for there in (differ, jolts, watchful))
    return State(
        step=np.zeros(envs, np.int64),
        position=np.zeros((envs, vehicles)),
        speed=np.zeros((envs, vehicles)),
        acceleration=np.zeros((envs, vehicles)),
        command=np.zeros((envs, vehicles)),
        previous_gap=np.full((envs, vehicles), np.inf),
        disbanding_s=np.full((envs, num_platoons), np.inf),
        takeover_delay_s=np.zeros((envs, vehicles)),
        driver_headway_s=np.zeros((envs, vehicles)),
        speed_error=np.zeros((envs, vehicles)),
        intact_error=np.zeros(envs),
        rear_collided=np.zeros((envs, vehicles), np.bool_),
        collided=np.zeros((envs, vehicles), np.bool_),
        collided_intact=np.zeros((envs, vehicles), np.bool_),
        first_collision_s=np.full(envs, -1.0),
        stops=np.zeros((envs, vehicles), np.int64),
        moving=np.ones((envs, vehicles), np.bool_),
        braking_s=np.zeros((envs, vehicles)),
        braking_mps2=np.zeros((envs, vehicles)),
        noise_mps2=np.zeros((envs, vehicles)),
        record_s=np.full((envs, vehicles), np.inf),
        record_position=np.zeros((envs, vehicles)),
        record_speed=np.zeros((envs, vehicles)),
        record_acceleration=np.zeros((envs, vehicles)),
        record_command=np.zeros((envs, vehicles)),
        heard_s=np.zeros((envs, vehicles)),
        opening_s=np.zeros(envs),
        jam_place=np.full(envs, -1),
        jam_steps=np.zeros(envs, np.int64),
        smallest_gap=np.full(envs, np.inf),
        false_alarms=np.zeros(envs),
        noted_acceleration=np.zeros((envs, vehicles)),
        noted=np.zeros(envs, np.int64),
        acceleration_squares=np.zeros(envs),
        jerk_squares=np.zeros(envs),
        work_kj=np.zeros(envs),
        driven_km=np.zeros(envs),
        disturbed_s=np.zeros(envs),
        tau_s=np.zeros(own),
        proportional_gain=np.zeros(own),
        derivative_gain=np.zeros(own),
        attacked_s=np.full(envs, -np.inf),
        attacked_member=np.ones(envs, np.int64),
        jolted_until_s=np.zeros(jolted),
        alarming_braking_mps2=np.zeros(driver),
        alarming_jerk_mps3=np.zeros(driver),
        alarming_gap_m=np.zeros(driver),
        reaction_s=np.zeros(driver),
        felt_mps2=np.zeros(driver),
        chance=np.zeros((envs, 4), np.uint64),
    )
