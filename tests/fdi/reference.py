"""The platoon under false data injection once more, vehicle by vehicle, and drawn tasks: independent of the package."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from cps_envs.core.types import Array, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task


class Anchor(NamedTuple):
    """The largest impact speeds of a task (6.5): of the relaxation, and of whole levels, m/s."""

    relaxed: float
    optimum: float


ANCHORS = {
    "x1>1": Anchor(3.5619, 3.4075),
    "x2>2": Anchor(4.0014, 3.8894),
    "x3>3": Anchor(4.8723, 4.7306),
    "x3>4": Anchor(3.4643, 3.4274),
    "x4>4": Anchor(6.8159, 6.5151),
    "v1>1": Anchor(3.5691, 3.4022),
    "v4>4": Anchor(5.9057, 5.8555),
}


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


class Course(NamedTuple):
    errors: FloatArray  # (k + 1, 2n)
    commands: FloatArray  # (k, n)
    readings: FloatArray  # (k, 2n) as errors


def play(config: FdiConfig, sensors: Sensors, levels: IntArray, start: FloatArray | None = None) -> Course:
    """Levels (k, q) from e(0) = start; ZOH by the exponential of the closed loop, written out from (3.3) to (3.7)."""
    n = config.num_vehicles
    error = np.zeros(2 * n) if start is None else start
    errors, commands, readings = [error], [], []
    for level in levels:
        injection = np.zeros(2 * n)
        for place, vehicle in enumerate(sensors.range):
            injection[vehicle - 1] = level[place] * config.range_resolution_m
        for place, vehicle in enumerate(sensors.range_rate):
            injection[n + vehicle - 1] = level[len(sensors.range) + place] * config.rate_resolution_mps
        commands.append(_commands(config, error, injection))
        readings.append(error + injection)
        error = _after(config, error, injection)
        errors.append(error)
    return Course(np.array(errors), np.array(commands), np.array(readings))


def _commands(config: FdiConfig, error: FloatArray, injection: FloatArray) -> FloatArray:
    n, k_p, k_d = config.num_vehicles, config.proportional_gain, config.derivative_gain
    found = np.zeros(n)
    for i in range(n):
        found[i] = k_p * (error[i] + injection[i]) + k_d * (error[n + i] + injection[n + i])
        if i > 0:  # the rear readings, which nobody attacks
            found[i] -= k_p * error[i - 1] + k_d * error[n + i - 1]
    return found


def _after(config: FdiConfig, error: FloatArray, injection: FloatArray) -> FloatArray:
    """The next error; (3.16) by probing the commands with unit vectors."""
    n, dt_s = config.num_vehicles, config.dt_s
    joint = np.concatenate([error, _commands(config, np.zeros(2 * n), injection)])
    if config.discretisation == "zoh":
        return (_propagation(config) @ joint)[: 2 * n]
    if config.discretisation == "euler":
        return error + dt_s * (_generator(config) @ joint)[: 2 * n]
    acceleration = (np.eye(n, k=1) - np.eye(n)) @ _commands(config, error, injection)
    gap, speed = error[:n], error[n:]
    return np.concatenate([gap + dt_s * speed + dt_s**2 / 2 * acceleration, speed + dt_s * acceleration])


def _generator(config: FdiConfig) -> FloatArray:
    """Of e and of the held accelerations that injections command, (3n, 3n)."""
    n = config.num_vehicles
    feedback = np.column_stack([_commands(config, unit, np.zeros(2 * n)) for unit in np.eye(2 * n)])
    closing = np.eye(n, k=1) - np.eye(n)  # acceleration of the vehicle ahead minus one's own
    found = np.zeros((3 * n, 3 * n))
    found[:n, n : 2 * n] = np.eye(n)
    found[n : 2 * n, : 2 * n] = closing @ feedback
    found[n : 2 * n, 2 * n :] = closing
    return found


@lru_cache
def _propagation(config: FdiConfig) -> FloatArray:
    return np.asarray(expm(config.dt_s * _generator(config)))


@st.composite
def tasks(draw: st.DrawFn, num_vehicles: int = 4, most: int = 3) -> Task:
    vehicles = st.integers(1, num_vehicles)
    chosen = draw(st.sets(st.tuples(st.sampled_from("xv"), vehicles), min_size=1, max_size=most))
    ranges, rates = (tuple(sorted(i for kind, i in chosen if kind == wanted)) for wanted in "xv")
    return Task(Sensors(ranges, rates), draw(vehicles))
