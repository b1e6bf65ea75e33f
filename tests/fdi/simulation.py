"""An independent statement of the attacked platoon, step by step and vehicle by vehicle, and drawn tasks."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from scipy.linalg import expm

from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task


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
