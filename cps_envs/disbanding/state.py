"""The state of a batch of strings of platoons, as plain arrays that numba kernels work on in place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class State(NamedTuple):
    """B episodes of N platoons with M = N * n vehicles in all.

    Vehicles are numbered front to rear along the string: q = 0 is the front vehicle, q - 1 the predecessor of q, and
    platoon p = q // n, also counted from the front (the paper's platoon index is N - p).
    """

    step: NDArray[np.int64]  # (B,) integration steps done; the time is step * dt
    position: NDArray[np.float64]  # (B, M) m
    speed: NDArray[np.float64]  # (B, M) m/s
    acceleration: NDArray[np.float64]  # (B, M) m/s2
    command: NDArray[np.float64]  # (B, M) m/s2, final commanded acceleration of the last step
    previous_gap: NDArray[np.float64]  # (B, M) m, gap ahead at the step before; +inf at the start and for q = 0
    disbanding_s: NDArray[np.float64]  # (B, N) s, when each platoon is disbanded; +inf while intact
    takeover_delay_s: NDArray[np.float64]  # (B, M) s between disbanding and the driver's taking over
    driver_headway_s: NDArray[np.float64]  # (B, M) s, time headway of each human driver
    speed_error: NDArray[np.float64]  # (B, M) m/s, sum over the steps of |v - v_d|
    intact_error: NDArray[np.float64]  # (B,) m/s, sum over the steps of the mean |v - v_d| of the vehicles intact then
    rear_collided: NDArray[np.bool_]  # (B, M) the gap ahead was <= 0 at some time
    collided: NDArray[np.bool_]  # (B, M) involved in a collision: rear_collided, or the predecessor of such a vehicle
    collided_intact: NDArray[np.bool_]  # (B, M) became involved while its platoon was intact
    first_collision_s: NDArray[np.float64]  # (B,) s, -1 while there is none
    stops: NDArray[np.int64]  # (B, M) number of stops (speed below 0.01 m/s, re-armed above 1 m/s)
    moving: NDArray[np.bool_]  # (B, M) a further stop would count


def allocate(num_envs: int, num_platoons: int, vehicles_per_platoon: int) -> State:
    """A state with every array zero; `initial.place` fills the episodes."""
    envs, vehicles = num_envs, num_platoons * vehicles_per_platoon
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
    )
