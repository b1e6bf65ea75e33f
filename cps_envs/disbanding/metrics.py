"""The numbers of chapter 2 read from a state: velocity errors (2.8), collisions and stops."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.state import State

METRICS = (
    "velocity_error_all",  # percent, (2.8) over all vehicles
    "velocity_error_intact",  # percent, (2.8) over the vehicles of platoons never disbanded
    "velocity_error_intact_now",  # percent, (2.8) over the vehicles intact at each step
    "collided",  # vehicles involved in a collision
    "collided_intact",  # of these, the ones whose platoon was intact then
    "first_collision_s",  # s, -1 if none
    "stopped_share",  # percent of the vehicles of platoons never disbanded that stopped at least once
)


@kernel
def measure(state: State, parameters: NDArray[np.void], horizon_steps: int, out: NDArray[np.float64]) -> None:
    """Fill `out` (B, len(METRICS)) with the metrics of each episode so far.

    Velocity errors are divided by the steps of the whole episode, `horizon_steps`: they grow to the final value.
    Shares over an empty set of vehicles are 0.
    """
    for b in range(state.step.shape[0]):
        p = parameters[b]
        size, vehicles = p.vehicles_per_platoon, p.num_vehicles
        percent = 100.0 / (horizon_steps * p.desired_speed_mps)
        total, intact_total, intact, stopped, collided, collided_intact = 0.0, 0.0, 0, 0, 0, 0
        for q in range(vehicles):
            total += state.speed_error[b, q]
            collided += state.collided[b, q]
            collided_intact += state.collided_intact[b, q]
            if state.disbanding_s[b, q // size] == np.inf:
                intact += 1
                intact_total += state.speed_error[b, q]
                stopped += state.stops[b, q] > 0
        out[b, 0] = percent * total / vehicles
        out[b, 1] = percent * intact_total / max(intact, 1)
        out[b, 2] = percent * state.intact_error[b]
        out[b, 3] = collided
        out[b, 4] = collided_intact
        out[b, 5] = state.first_collision_s[b]
        out[b, 6] = 100.0 * stopped / max(intact, 1)
