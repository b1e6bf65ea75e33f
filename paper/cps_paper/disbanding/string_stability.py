"""Does a disturbance grow from platoon to platoon? Frequency response of the linear laws (2.1) to (2.4).

The text of section 2.2.1 says that bidirectional control guarantees string stability. For ten vehicles it does not: the
gain from the speed of one platoon's last vehicle to that of the next exceeds one at periods around 40 s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from cps_envs.core.types import FloatArray
from cps_envs.disbanding.config import PAPER

FREQUENCIES_RAD_S = np.geomspace(1e-3, 10.0, 2000)


class Peak(NamedTuple):
    """The largest amplification and where it lies."""

    gain: float
    frequency_rad_s: float

    @property
    def period_s(self) -> float:
        """Period of the disturbance that grows most."""
        return float(2.0 * np.pi / self.frequency_rad_s)


def platoon_matrices(num_vehicles: int, tau_s: float) -> tuple[FloatArray, FloatArray]:
    """A (3n, 3n) and B (3n, 2) of one platoon's deviations [x, v, a], leader first; inputs: x and v of who is ahead."""
    n, k_p, k_d = num_vehicles, PAPER.proportional_gain, PAPER.derivative_gain
    position, speed = np.zeros((n, n)), np.zeros((n, n))  # u = position @ x + speed @ v + ahead @ inputs
    for i in range(n):
        middle = 0 < i < n - 1
        for j, sign in ((i, -2.0 if middle else -1.0), (i - 1, 1.0), (i + 1, 1.0 if middle else 0.0)):
            if 0 <= j < n:
                position[i, j], speed[i, j] = sign * k_p, sign * k_d
    speed[0, 0] -= k_p * PAPER.headway_s
    identity, zero = np.eye(n), np.zeros((n, n))
    a = np.block([[zero, identity, zero], [zero, zero, identity], [position / tau_s, speed / tau_s, -identity / tau_s]])
    b = np.zeros((3 * n, 2))
    b[2 * n] = np.array([k_p, k_d]) / tau_s
    return a, b


def rear_to_rear_gain(num_vehicles: int, tau_s: float, frequencies_rad_s: FloatArray) -> FloatArray:
    """|v_last / v_last of the platoon ahead| at each frequency (F,)."""
    a, b = platoon_matrices(num_vehicles, tau_s)
    s = 1j * np.asarray(frequencies_rad_s)[:, np.newaxis, np.newaxis]
    inputs = b[:, :1] + s * b[:, 1:]  # of a unit position ahead
    response = np.linalg.solve(s * np.eye(len(a)) - a, inputs)
    gain: FloatArray = np.abs(response[:, num_vehicles - 1, 0])
    return gain


def peak_gain(num_vehicles: int, tau_s: float) -> Peak:
    """The largest gain over all frequencies; 1 at frequency 0 where nothing is amplified."""

    def attenuation(log_frequency: float) -> float:
        return -float(rear_to_rear_gain(num_vehicles, tau_s, np.exp([log_frequency]))[0])

    grid = rear_to_rear_gain(num_vehicles, tau_s, FREQUENCIES_RAD_S)
    best = int(np.argmax(grid))
    around = np.log(FREQUENCIES_RAD_S[[max(best - 1, 0), min(best + 1, len(grid) - 1)]])
    found = minimize_scalar(attenuation, bounds=tuple(around), method="bounded", options={"xatol": 1e-8})
    return Peak(-float(found.fun), float(np.exp(found.x)))
