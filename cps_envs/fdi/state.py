"""B episodes as kernels see them: their state, the numbers of the configuration, the matrices of the platoon."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import fill, inlined, maker, pack, records, room, unpack
from cps_envs.core.declare.config import bounds
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig


class Tally(NamedTuple):
    """Readings counted since the start of an episode."""

    injected: int
    replaced: int
    replaced_in_vain: int  # replaced though nothing was injected


class State(NamedTuple):
    """B episodes with S slots for injections; the R readings are errors, ranges (m) of vehicles 1..n, then rates (m/s).

    `error` is that of now and `legal` is for the next step; the other readings and accelerations belong to the last
    step. What the commands were computed from is `used`.

    With a filter the rears of vehicles 2..n come after the fronts, ranges and rates alike; `reading`, `injection` and
    `prediction` are those of now, which the next commands will be computed from.
    """

    error: FloatArray  # (B, 2n) true e
    injection: FloatArray  # (B, R) d
    reading: FloatArray  # (B, R) e + d
    prediction: FloatArray  # (B, 2n) of the true values by the model, from readings that the defender trusted
    used: FloatArray  # (B, R) the readings, or what replaced them
    trust: FloatArray  # (B, R) 1, or 0 where the reading was replaced
    command: FloatArray  # (B, n) applied, m/s2
    correction: FloatArray  # (B, n) the defender's part of it, m/s2
    rear: FloatArray  # (B, n) true range errors, which the rear sensors of the vehicles ahead saw
    residual: FloatArray  # (B, n) kinematic residual, m
    legal: IntArray  # (B, S, 2) lowest and highest legal level of each slot
    disturbance: FloatArray  # (B, k, n) accelerations that no vehicle commanded, m/s2; each holds for some steps
    phase: IntArray  # (B, n) steps for which each vehicle's first one has held before the episode began
    noise: FloatArray  # (B, horizon + 1, R) of the readings, in standard deviations; or (B, 0, R)
    deviation: FloatArray  # (B, R) of each sensor's noise, m and m/s; or (B, 0)
    covariance: FloatArray  # (B, 2n, 2n) of `prediction`; or (B, 0, 0)
    doubted: IntArray  # (B, R) steps for which a reading has been replaced without a break
    onset: IntArray  # (B,) the first step whose readings injections may change
    step: IntArray  # (B,) steps done
    task: IntArray  # (B,) index of the task
    tally: Array  # (B,) records of `Tally`


def allocate(config: FdiConfig, num_envs: int, slots: int) -> State:
    """The state of B episodes that have not begun; `slots` is S."""
    n, filters = config.num_vehicles, config.estimator == "kalman"
    pairs, sensors, vehicles = (num_envs, 2 * n), (num_envs, config.num_readings), (num_envs, n)
    return State(
        error=np.zeros(pairs),
        injection=np.zeros(sensors),
        reading=np.zeros(sensors),
        prediction=np.zeros(pairs),
        used=np.zeros(sensors),
        trust=np.zeros(sensors),
        command=np.zeros(vehicles),
        correction=np.zeros(vehicles),
        rear=np.zeros(vehicles),
        residual=np.zeros(vehicles),
        legal=np.zeros((num_envs, slots, 2), np.int64),
        disturbance=np.zeros((num_envs, config.most_blocks, n)),
        phase=np.zeros(vehicles, np.int64),
        noise=np.zeros((num_envs, config.horizon + 1 if filters else 0, config.num_readings)),
        deviation=np.tile(config.sensor_noise[: config.num_readings if filters else 0], (num_envs, 1)),
        covariance=np.zeros((num_envs, 2 * n, 2 * n) if filters else (num_envs, 0, 0)),
        doubted=np.zeros(sensors, np.int64),
        onset=np.zeros(num_envs, np.int64),
        step=np.zeros(num_envs, np.int64),
        task=np.zeros(num_envs, np.int64),
        tally=records(Tally, num_envs),
    )


class Constants(NamedTuple):
    """The numbers of a configuration that kernels need: its fields and properties, and answers to its choices."""

    horizon: int
    dt_s: float
    desired_gap_m: float
    proportional_gain: float
    derivative_gain: float
    min_acceleration_mps2: float
    max_acceleration_mps2: float
    range_resolution_m: float
    rate_resolution_mps: float
    range_levels: int
    rate_levels: int
    correction_levels: int
    alarm_cost_mps2: float
    correction_cost: float
    limit_commands: bool
    limit_readings: bool
    gap_spread_m: float
    speed_spread_mps: float
    disturbance_mps2: float
    hold_steps: int
    readings: int  # R
    quantised: bool
    alarm_steps: int
    correction_step_mps2: float
    clips: bool  # limits = "clip"
    pays_any: bool  # paid_pair = "any"
    pays_growth: bool  # goal = "instability"
    draws: bool  # resets draw the task
    draws_gains: bool
    nominal_proportional_gain: float
    nominal_derivative_gain: float
    holds: bool  # commands are held over a step
    filters: bool  # estimator = "kalman"


def constants_of(config: FdiConfig) -> Array:
    """The constants of a configuration as records (1,), see `core.compute.kernels.pack`."""
    derived = {
        "correction_step_mps2": config.max_correction_mps2 / config.correction_levels,
        "clips": config.limits == "clip",
        "pays_any": config.paid_pair == "any",
        "pays_growth": config.goal == "instability",
        "draws": bool(config.tasks),
        "draws_gains": config.gain_spread > 0,
        "nominal_proportional_gain": config.proportional_gain,
        "nominal_derivative_gain": config.derivative_gain,
        "holds": config.limits == "clip" or config.gain_spread > 0,
        "filters": config.estimator == "kalman",
        "disturbance_mps2": bounds(config.disturbance_mps2)[1],
        "readings": config.num_readings,
        "alarm_steps": max(round(config.alarm_after_s / config.dt_s), 1),
    }
    values: dict[str, Any] = {name: derived.get(name, getattr(config, name, None)) for name in Constants._fields}
    return pack(Constants(**values))


class Matrices(NamedTuple):
    """The sampled platoon, see `model.Model`, transposed: a row for each input, so that loops run over outputs."""

    step: FloatArray  # (5n, 2n): A, B, correction
    hold: FloatArray  # (3n, 2n): A_d, B_d
    spread: FloatArray  # (2n, 2n) by which a step's disturbances widen the filter's covariance


def matrices_of(config: FdiConfig) -> Matrices:
    """The matrices of a configuration."""
    model = config.model
    return Matrices(
        spread=disturbance_covariance(config),
        step=np.ascontiguousarray(np.hstack([model.transition, model.injection, model.correction]).T),
        hold=np.ascontiguousarray(np.hstack([model.coast, model.command]).T),
    )


def disturbance_covariance(config: FdiConfig) -> FloatArray:
    """What a step's disturbances add to the covariance (2n, 2n) of errors, for a filter that takes them for white.

    A disturbance that lasts k steps moves speeds like a white one of k times its variance, seen over many steps.
    """
    variance = config.hold_steps * bounds(config.disturbance_mps2)[1] ** 2
    return np.ascontiguousarray(variance * config.model.command @ config.model.command.T)


class Layout(NamedTuple):
    """How a role's observations are encoded, see `core.declare.fields.Fields`."""

    offsets: Array  # (1,) where each field begins
    scale: FloatArray  # (2, size)


class Batch(NamedTuple):
    """All that kernels know of B environments."""

    state: State
    metrics: Array  # (B,) records of `payoff.Metrics`
    over: BoolArray  # (B,) episodes that physics has ended
    tasks: IntArray  # (T, S + 1) sensors of each slot, -1 where not attacked, and the target's index
    constants: Array  # (1,) records of `Constants`, or (B,) where resets draw some of them
    matrices: Matrices
    attacker: Layout
    defender: Layout


class Scratch(NamedTuple):
    """What kernels work with besides the episodes; one episode uses it after the other."""

    trust: FloatArray  # (R,) of the defender in the present step, 1 or 0
    correction: FloatArray  # (n,) of the defender in the present step, m/s2
    offset: FloatArray  # (2n,) of what is used from the true values
    error: FloatArray  # (2n,)
    row: FloatArray  # (S,) coefficients of levels
    which: IntArray  # (S,) the slots that they belong to
    slot: IntArray  # (R,) of each reading, -1 where it has none
    level: IntArray  # (S,) injected
    interval: IntArray  # (S, 2) legal levels while they are chosen


@maker
def new_scratch(n: int, readings: int, slots: int) -> Scratch:
    """Of a platoon whose defender trusts every sensor and corrects nothing. Each array takes time, so there are few."""
    reals, whole = room(readings + 5 * n + slots), room(readings + 2 * slots, np.int64)
    trust, rest = reals[:readings], reals[readings:]
    fill(trust, 1.0)
    fill(rest, 0.0)
    fill(whole, 0)
    return Scratch(
        trust,
        rest[:n],
        rest[n : 3 * n],
        rest[3 * n : 5 * n],
        rest[5 * n :],
        whole[:slots],
        whole[slots : slots + readings],
        whole[slots + readings :],
        room((slots, 2), np.int64),
    )


@inlined
def constants_for(batch: Batch, b: int) -> Constants:
    """The numbers of an episode: its own where resets draw some, else those that all share."""
    return unpack(Constants, batch.constants, min(b, batch.constants.size - 1))


@inlined
def add_product(matrix: FloatArray, start: int, vector: FloatArray, total: FloatArray) -> None:
    """Add a block of a transposed matrix times a vector (k,) to `total`; the block's rows begin at `start`."""
    for j in range(vector.size):
        value = vector[j]
        if value != 0:
            for i in range(total.size):
                total[i] += matrix[start + j, i] * value
