"""What nobody measures: heat that drifts over the day, and an outside that is not as forecast."""

from __future__ import annotations

import math
from math import exp
from typing import NamedTuple

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.compute.streams import between, fill_normal, next_normal, normal, uniform
from cps_envs.core.declare.config import Range, bounds
from cps_envs.core.types import Array, FloatArray
from cps_envs.hvac.config import HvacConfig


class Drift(NamedTuple):
    """The distribution of a day's unknown heat and of its forecast errors."""

    least_heat_w: float
    most_heat_w: float
    least_bias_c: float
    most_bias_c: float
    least_drift_c: float
    most_drift_c: float
    kept_heat: float  # share of its value that slow heat keeps at each step
    kept_outdoor: float  # the same of the outside
    held: float  # probability that a level of heat stays for another step


def drift_of(config: HvacConfig) -> Drift:
    """The drift of a configuration."""
    step_h = config.step_s / 3600.0
    ends = [float(end) for size in disturbances(config) for end in bounds(size)]
    return Drift(*ends, *(exp(-step_h / h) for h in (config.drift_h, config.forecast_drift_h, config.drift_hold_h)))


def disturbances(config: HvacConfig) -> tuple[Range, Range, Range]:
    """The sizes of heat drift, forecast bias and forecast drift; (0, 0) or 0 is none."""
    return config.heat_drift_w, config.forecast_bias_c, config.forecast_drift_c


@inlined
def draw_disturbance(
    stream: Array, drift: Drift, heat_w: FloatArray, outdoor_c: FloatArray, size: FloatArray, level: FloatArray
) -> None:
    """Fill the heat (K, n), W, and what the outside is warmer than forecast (K,), C; both may have no rows.

    `size` and `level` (n,) are scratch. What the configuration leaves out draws nothing.
    """
    if heat_w.shape[0] > 0:
        draw_heat(stream, drift, heat_w, size, level)
    if outdoor_c.size > 0:
        bias = between(stream, drift.least_bias_c, drift.most_bias_c) * normal(stream)
        most = between(stream, drift.least_drift_c, drift.most_drift_c)
        fill_normal(stream, outdoor_c)
        slow_course(outdoor_c.reshape(-1, 1), drift.kept_outdoor)
        for k in range(outdoor_c.size):
            outdoor_c[k] = outdoor_c[k] * most + bias


@inlined
def draw_heat(stream: Array, drift: Drift, course: FloatArray, size: FloatArray, level: FloatArray) -> None:
    """Fill the unmeasured heat (K, n), W: in each zone half of its variance is slow, the other half comes in steps."""
    for i in range(size.size):
        size[i] = between(stream, drift.least_heat_w, drift.most_heat_w) / math.sqrt(2.0)
    fill_normal(stream, course.reshape(-1))
    slow_course(course, drift.kept_heat)
    add_steps(stream, drift.held, course, level)
    for k in range(course.shape[0]):
        for i in range(course.shape[1]):
            course[k, i] *= size[i]


@inlined
def slow_course(course: FloatArray, kept: float) -> None:
    """Turn normal numbers (K, n) into stationary processes of the first order and variance 1.

    They keep a share `kept` of their value at each step.
    """
    fresh = math.sqrt(1.0 - kept * kept)
    for k in range(1, course.shape[0]):
        for i in range(course.shape[1]):
            course[k, i] = kept * course[k - 1, i] + fresh * course[k, i]


@inlined
def add_steps(stream: Array, held: float, course: FloatArray, level: FloatArray) -> None:
    """Add steps of variance 1 to a course (K, n): normal numbers that stay for another step with probability `held`.

    All levels are drawn before what says how long they last: a first pass finds where that begins. `level` (n,) is
    scratch.
    """
    high, low, up, down = stream[0], stream[1], stream[2], stream[3]
    for _ in range(course.size):
        stream[0], stream[1], _ = next_normal(stream[0], stream[1], up, down)
    for k in range(course.shape[0]):
        for i in range(course.shape[1]):
            high, low, fresh = next_normal(high, low, up, down)
            stays = uniform(stream) < held
            if k == 0 or not stays:
                level[i] = fresh
            course[k, i] += level[i]
