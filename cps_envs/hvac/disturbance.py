"""What nobody measures: heat that drifts over the day, and an outside that is not as forecast."""

from __future__ import annotations

from math import exp

import numpy as np

from cps_envs.core.config import Range, bounds
from cps_envs.core.kernels import kernel
from cps_envs.core.types import FloatArray
from cps_envs.hvac.config import HvacConfig


class Disturbance:
    """Draws the courses of a day. What the configuration leaves out draws nothing."""

    def __init__(self, config: HvacConfig) -> None:
        step_h = config.step_s / 3600.0
        self._heat_w, self._bias_c, self._drift_c = map(bounds, disturbances(config))
        self._kept_heat, self._kept_outdoor = exp(-step_h / config.drift_h), exp(-step_h / config.forecast_drift_h)
        self._held = exp(-step_h / config.drift_hold_h)

    def draw(self, generator: np.random.Generator, heat_w: FloatArray, outdoor_c: FloatArray) -> None:
        """Fill the heat (K, n), W, and what the outside is warmer than forecast (K,), C; both may have no rows."""
        if len(heat_w) > 0:
            draw_heat(generator, self._heat_w, self._kept_heat, self._held, heat_w)
        if len(outdoor_c) > 0:
            bias = generator.uniform(*self._bias_c) * generator.standard_normal()
            size = generator.uniform(*self._drift_c)
            slow_course(generator.standard_normal((len(outdoor_c), 1)), self._kept_outdoor, outdoor_c[:, np.newaxis])
            outdoor_c *= size
            outdoor_c += bias


def disturbances(config: HvacConfig) -> tuple[Range, Range, Range]:
    """The sizes of heat drift, forecast bias and forecast drift; (0, 0) or 0 is none."""
    return config.heat_drift_w, config.forecast_bias_c, config.forecast_drift_c


def draw_heat(
    generator: np.random.Generator, size_w: tuple[float, float], kept: float, held: float, course: FloatArray
) -> None:
    """Fill the unmeasured heat (K, n), W: in each zone half of its variance is slow, the other half comes in steps."""
    size = generator.uniform(*size_w, course.shape[1])
    stepped = np.empty_like(course)
    slow_course(generator.standard_normal(course.shape), kept, course)
    step_course(generator.standard_normal(course.shape), generator.random(course.shape), held, stepped)
    course += stepped
    course *= size / np.sqrt(2.0)


@kernel
def slow_course(normal: FloatArray, kept: float, course: FloatArray) -> None:
    """Fill stationary first-order processes (K, n) of variance 1, which keep a share of their value at each step."""
    fresh = np.sqrt(1.0 - kept * kept)
    for i in range(course.shape[1]):
        course[0, i] = normal[0, i]
        for k in range(1, course.shape[0]):
            course[k, i] = kept * course[k - 1, i] + fresh * normal[k, i]


@kernel
def step_course(normal: FloatArray, uniform: FloatArray, held: float, course: FloatArray) -> None:
    """Fill levels (K, n) of variance 1, each of which stays for another step with the probability `held`."""
    for i in range(course.shape[1]):
        course[0, i] = normal[0, i]
        for k in range(1, course.shape[0]):
            course[k, i] = course[k - 1, i] if uniform[k, i] < held else normal[k, i]
