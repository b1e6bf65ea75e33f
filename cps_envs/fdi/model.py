"""The linear platoon model (3.3) to (3.16) in continuous and in sampled time."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.discretisation import zero_order_hold
from cps_envs.core.types import FloatArray

DISCRETISATIONS = ("zoh", "euler", "zohu")


class Model(NamedTuple):
    """e = [e_x,1..e_x,n, e_v,1..e_v,n], gap errors (m) and relative speeds (m/s, closing < 0); vehicle 1 is last.

    Columns of `readings` and `injection` belong to the 2n front sensors: ranges of vehicles 1..n, then range-rates.
    A step is e <- transition @ e + injection @ d + correction @ c. Shared and read only.
    """

    feedback: FloatArray  # A_2 (n, 2n): commands without injection, u = A_2 e, m/s2
    readings: FloatArray  # B_a (n, 2n) of all front sensors: u = A_2 e + B_a d
    transition: FloatArray  # A (2n, 2n)
    injection: FloatArray  # B (2n, 2n) of all front sensors
    correction: FloatArray  # (2n, n) of accelerations added to the commands and held over the step
    coast: FloatArray  # A_d (2n, 2n): double integrators, for commands that are held over the step
    command: FloatArray  # B_d (2n, n)

    @property
    def spectral_radius(self) -> float:
        """Largest modulus of the eigenvalues of `transition`; below 1 the platoon is stable without attack."""
        return float(np.abs(np.linalg.eigvals(self.transition)).max())


@lru_cache(maxsize=64)
def platoon_model(
    num_vehicles: int, proportional_gain: float, derivative_gain: float, dt_s: float, discretisation: str
) -> Model:
    """The model of a platoon with gains k_p (1/s2) and k_d (1/s), sampled every dt_s.

    `discretisation`: "zoh" holds injections over the step in the closed loop, which stays continuous; "euler" is the
    forward Euler step of the closed loop; "zohu" holds the commands and integrates exactly.
    """
    n = num_vehicles
    unit, zero = np.eye(n), np.zeros((n, n))
    difference = unit - np.eye(n, k=-1)  # L: own pair minus the pair behind; row 1 has nobody behind
    feedback = np.hstack([proportional_gain * difference, derivative_gain * difference])
    readings = np.hstack([proportional_gain * unit, derivative_gain * unit])
    chain = np.block([[zero, unit], [zero, zero]])  # A_1
    drive = np.vstack([zero, np.eye(n, k=1) - unit])  # B_1: pair i has vehicle i + 1 ahead, pair n the reference
    closed = chain + drive @ feedback  # A_c
    held = drive @ np.hstack([readings, unit])
    coast, command = zero_order_hold(chain, drive, dt_s)
    if discretisation == "zoh":
        transition, inputs = zero_order_hold(closed, held, dt_s)
    elif discretisation == "euler":
        transition, inputs = np.eye(2 * n) + dt_s * closed, dt_s * held
    else:
        transition, inputs = coast + command @ feedback, command @ np.hstack([readings, unit])
    matrices = (feedback, readings, transition, inputs[:, : 2 * n], inputs[:, 2 * n :], coast, command)
    model = Model(*(np.ascontiguousarray(matrix) for matrix in matrices))
    for matrix in model:
        matrix.setflags(write=False)
    return model
