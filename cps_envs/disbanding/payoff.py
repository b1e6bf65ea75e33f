"""The numbers of chapter 2 read from a state, and what the attacker is paid of them."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, inlined, kernel, least, records, unpack, view
from cps_envs.core.declare.measures import Measure
from cps_envs.core.types import Array, FloatArray
from cps_envs.disbanding.state import Constants, State


class Metrics(NamedTuple):
    """What is known of an episode so far; a batch has them as `core.compute.kernels.records`, (B,)."""

    velocity_error_all: Annotated[float, Measure("%", "(2.8): error of the speed over all vehicles")]
    velocity_error_intact: Annotated[
        float, Measure("%", "(2.8) over the vehicles of platoons that were never disbanded")
    ]
    velocity_error_intact_now: Annotated[float, Measure("%", "(2.8) over the vehicles that are intact at each step")]
    collided: Annotated[float, Measure("", "vehicles that took part in a collision")]
    collided_intact: Annotated[float, Measure("", "of these, the ones whose platoon was intact then")]
    first_collision_s: Annotated[float, Measure("s", "time of the first collision; -1 if there was none")]
    stopped_share: Annotated[float, Measure("%", "vehicles of never disbanded platoons that stopped at least once")]
    collision_penalty: Annotated[
        float, Measure("%", "charge for intact vehicles in collisions, in points of velocity error")
    ]
    end_charge: Annotated[float, Measure("%", "charge for the rest of an episode that a collision ended, at 100 %")]
    disbanded_platoons: Annotated[float, Measure("", "platoons that were disbanded; not paid")]
    # With report="safety":
    smallest_gap_m: Annotated[float, Measure("m", "smallest gap ahead of an intact vehicle, at control periods")]
    false_alarms: Annotated[float, Measure("%", "vehicles and time corrected with no disbanded platoon ahead")]
    # With report="full", of the vehicles intact at each moment:
    acceleration_mps2: Annotated[float, Measure("m/s²", "root mean square over intact vehicles")]
    jerk_mps3: Annotated[
        float, Measure("m/s³", "root mean square of changes of acceleration within 0.1 s, over intact vehicles")
    ]
    energy_kj_per_km: Annotated[
        float, Measure("kJ/km", "traction, by the model of report = full, over intact vehicles")
    ]
    recovery_s: Annotated[
        float, Measure("s", "from the first attack until all keep within 10 % of v_d; so far, while they do not")
    ]


MEASURED = {  # how many of them each `report` has
    "chapter": Metrics._fields.index("smallest_gap_m"),
    "safety": Metrics._fields.index("acceleration_mps2"),
    "full": len(Metrics._fields),
}


class Rules(NamedTuple):
    """What a game step needs of the configuration."""

    horizon_steps: int  # integration steps in an episode
    collision_penalty: float  # points of E_v per 100/M vehicles
    pays_intact_now: bool  # velocity_error_intact_now instead of velocity_error_all
    steps_per_decision: int  # integration steps between two decisions of the attacker
    eventful: bool  # something happens between the steps: radio, noise, or what the safety metrics note


def measured(state: State, constants: Array, horizon_steps: int) -> Array:
    """The metrics (B,) of a state, without the charges: records of `Metrics`."""
    table = records(Metrics, len(constants))
    measure_all(state, constants, horizon_steps, table)
    return table


@kernel
def measure_all(state: State, constants: Array, horizon_steps: int, table: Array) -> None:
    """`measure` for B environments."""
    for b in range(table.size):
        measure(view(state, b), unpack(Constants, constants, b), horizon_steps, borrowed(table)[b])


@inlined
def measure(episode: State, c: Constants, horizon_steps: int, metrics: Record) -> None:
    """Fill the metrics of an episode, but for the charges.

    Velocity errors are divided by the steps of the whole episode, `horizon_steps`: they grow to the final value.
    Shares over an empty set of vehicles are 0.
    """
    size = c.vehicles_per_platoon
    percent = 100.0 / (horizon_steps * c.desired_speed_mps)
    total, intact_total, intact, stopped, collided, collided_intact = 0.0, 0.0, 0, 0, 0, 0
    for platoon in range(c.num_vehicles // size):
        is_intact = episode.disbanding_s[platoon] == np.inf
        for q in range(platoon * size, (platoon + 1) * size):
            total += episode.speed_error[q]
            collided += episode.collided[q]
            collided_intact += episode.collided_intact[q]
            if is_intact:
                intact += 1
                intact_total += episode.speed_error[q]
                stopped += episode.stops[q] > 0
    metrics.velocity_error_all = percent * total / c.num_vehicles
    metrics.velocity_error_intact = percent * intact_total / max(intact, 1)
    metrics.velocity_error_intact_now = percent * episode.intact_error[0]
    metrics.collided = collided
    metrics.collided_intact = collided_intact
    metrics.first_collision_s = episode.first_collision_s[0]
    metrics.stopped_share = 100.0 * stopped / max(intact, 1)
    metrics.smallest_gap_m = episode.smallest_gap[0]
    measure_ride(episode, metrics)
    metrics.false_alarms = 100.0 * episode.false_alarms[0] * c.period_steps / horizon_steps


@inlined
def measure_ride(episode: State, metrics: Record) -> None:
    """Fill what `ride` has noted; 0 where it has not."""
    noted, driven_km, first_s = max(episode.noted[0], 1), episode.driven_km[0], least(episode.disbanding_s)
    metrics.acceleration_mps2 = math.sqrt(episode.acceleration_squares[0] / noted)
    metrics.jerk_mps3 = math.sqrt(episode.jerk_squares[0] / noted)
    metrics.energy_kj_per_km = episode.work_kj[0] / driven_km if driven_km > 0.0 else 0.0
    metrics.recovery_s = max(0.0, episode.disturbed_s[0] - first_s)


@inlined
def charge(episode: State, c: Constants, rules: Rules, metrics: Record) -> float:
    """Fill the charges of an episode; returns the attacker's payoff so far."""
    metrics.collision_penalty = rules.collision_penalty * 100.0 / c.num_vehicles * metrics.collided_intact
    ended = c.stop_at_collision and metrics.collided_intact > 0.0
    metrics.end_charge = 100.0 * (1.0 - episode.step[0] / rules.horizon_steps) if ended else 0.0
    metrics.disbanded_platoons = count_disbanded(episode.disbanding_s)
    paid = metrics.velocity_error_intact_now if rules.pays_intact_now else metrics.velocity_error_all
    return float(paid + metrics.collision_penalty + metrics.end_charge)


@inlined
def count_disbanded(disbanding_s: FloatArray) -> int:
    """How many of the platoons (N,) are disbanded."""
    count = 0
    for platoon in range(disbanding_s.size):
        count += disbanding_s[platoon] < np.inf
    return count
