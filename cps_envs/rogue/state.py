"""The state of a batch of platoons, as structured arrays that numba kernels work on in place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

VEHICLE = np.dtype(
    [
        ("position", np.float64),  # m, of the centre
        ("speed", np.float64),  # m/s
        ("acceleration", np.float64),  # m/s2 in the last step, without impulses of contact
        ("command", np.float64),  # m/s2, desired in the last step, before the limits of the actuator
        ("front_detector", np.float64),  # m2/s3, z of the front side
        ("rear_detector", np.float64),  # m2/s3, z of the rear side
        ("growth", np.float64),  # m, s - sigma
        ("alarm", np.int64),  # 1 once the front neighbour has been detected, -1 the rear one, 0 none
        ("law", np.int64),  # by which an intact vehicle drove last, see `laws`
    ],
    align=True,
)
PAIR = np.dtype(
    [
        ("damage", np.float64),  # m (contact "pass") or m/s ("solid")
        ("collisions", np.int64),  # how often the pair came into contact
        ("armed", np.bool_),  # a contact would count as a new one
    ],
    align=True,
)
EPISODE = np.dtype(
    [
        ("drive_mps2", np.float64),  # alpha
        ("attacker_drive_mps2", np.float64),  # alpha of the seized vehicle
        ("drag_per_s", np.float64),  # beta
        ("reference_speed_mps", np.float64),  # v_ref
        ("reference_start_m", np.float64),  # x_ref at time 0
        ("attacker", np.int64),  # the seized vehicle, 0 = rear
        ("onset_step", np.int64),  # integration step from which on the attacker drives
        ("noise_seed", np.uint64),
    ],
    align=True,
)
LOG = np.dtype(
    [
        ("step", np.int64),  # integration steps done; the time is step * dt
        ("held_effort", np.float64),  # that the attacker decided last
        ("effort", np.float64),  # of the seized vehicle in the last step
        ("first_collision_s", np.float64),  # -1 while there is none
        ("first_alarm_s", np.float64),  # -1 while there is none
        ("formation_cost_s", np.float64),  # integral of the scattering c
    ],
    align=True,
)


class State(NamedTuple):
    """B episodes of n vehicles from the rear (0) to the leader (n - 1); pair i is vehicle i and the one ahead of it."""

    vehicles: NDArray[np.void]  # (B, n) of VEHICLE
    pairs: NDArray[np.void]  # (B, n - 1) of PAIR
    episode: NDArray[np.void]  # (B,) of EPISODE: what was drawn
    log: NDArray[np.void]  # (B,) of LOG


def allocate(num_envs: int, num_vehicles: int) -> State:
    """A state with everything zero; `episode.start` fills the episodes."""
    return State(
        vehicles=np.zeros((num_envs, num_vehicles), VEHICLE),
        pairs=np.zeros((num_envs, num_vehicles - 1), PAIR),
        episode=np.zeros(num_envs, EPISODE),
        log=np.zeros(num_envs, LOG),
    )
