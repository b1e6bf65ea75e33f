"""A platoon under false data injection once more, vehicle by vehicle and independent of the matrices of the package."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from cps_envs.core.types import Array
from cps_envs.fdi.config import FdiConfig


class Platoon:
    """Positions relative to the reference that drives ahead of the lead; index 0 = vehicle 1, the last."""

    def __init__(self, config: FdiConfig) -> None:
        self.config = config
        n = config.num_vehicles
        self.position = -config.desired_gap_m * np.arange(n, 0, -1.0)
        self.speed = np.zeros(n)

    @property
    def errors(self) -> Any:
        ahead = np.append(self.position[1:], self.reference[0])
        ahead_speed = np.append(self.speed[1:], self.reference[1])
        return np.concatenate([ahead - self.position - self.config.desired_gap_m, ahead_speed - self.speed])

    reference = (0.0, 0.0)

    def commands(self, position: Array, speed: Array, injection: Array) -> Array:
        """(3.6), (3.7): front readings plus injection, minus what the rear sensor sees of the follower."""
        c, n = self.config, self.config.num_vehicles
        u = np.zeros(n)
        for i in range(n):
            ahead, ahead_speed = (position[i + 1], speed[i + 1]) if i < n - 1 else self.reference
            front = ahead - position[i] - c.desired_gap_m + injection[i]
            u[i] = c.proportional_gain * front + c.derivative_gain * (ahead_speed - speed[i] + injection[n + i])
            if i > 0:
                rear = position[i] - position[i - 1] - c.desired_gap_m
                u[i] -= c.proportional_gain * rear + c.derivative_gain * (speed[i] - speed[i - 1])
        return u

    def step_continuous(self, injection: Array) -> None:
        """The closed loop between two samples, integrated to 1e-12."""
        n = self.config.num_vehicles

        def flow(_: Any, state: Any) -> Any:
            return np.concatenate([state[n:], self.commands(state[:n], state[n:], injection)])

        start = np.concatenate([self.position, self.speed])
        found = solve_ivp(flow, (0, self.config.dt_s), start, rtol=1e-12, atol=1e-12)
        self.position, self.speed = found.y[:n, -1], found.y[n:, -1]

    def step_held(self, injection: Array, correction: Array | float = 0.0, disturbance: Array | float = 0.0) -> None:
        """Clipped commands held over the step."""
        c = self.config
        u = self.commands(self.position, self.speed, injection) + correction
        u = np.clip(u, c.min_acceleration_mps2, c.max_acceleration_mps2) + disturbance
        self.position = self.position + c.dt_s * self.speed + c.dt_s**2 / 2 * u
        self.speed = self.speed + c.dt_s * u


def exact_step(a: Array, b: Array, dt_s: float) -> tuple[Array, Array]:
    """Zero-order hold by scipy."""
    joint = np.zeros((len(a) + b.shape[1],) * 2)
    joint[: len(a)] = np.hstack([a, b])
    step = expm(dt_s * joint)
    return step[: len(a), : len(a)], step[: len(a), len(a) :]
