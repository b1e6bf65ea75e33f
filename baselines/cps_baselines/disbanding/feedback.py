"""Extension beyond the paper: linear feedback with coefficients that a search found: `feedback.json`."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files

import numpy as np

from cps_baselines.disbanding.corrections import Corrections, Layout, look, sight_for
from cps_envs.core.compute.kernels import borrowed, kernel, lend
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import BoolArray, FloatArray, Observation

SIGNALS = ("gap_error", "relative_speed", "speed_deficit", "predecessor_acceleration", "ahead_speed", "law_command")
SCALES = np.array([10.0, 10.0, 10.0, 5.0, 10.0, 5.0])  # m, m/s, m/s, m/s2, m/s, m/s2
GAIN_MPS2 = 5.0
SHAPE = (2, len(SIGNALS))  # leaders, others
COEFFICIENTS = tuple(f"{vehicle}.{signal}" for vehicle in ("leader", "other") for signal in SIGNALS)


@lru_cache(maxsize=1)
def shipped_weights() -> FloatArray:
    """The coefficients (2, 6) that come with the package: of platoon leaders, then of all others."""
    text = files("cps_baselines.disbanding").joinpath("feedback.json").read_text(encoding="utf-8")
    return np.array(json.loads(text)["weights"], dtype=np.float64)


class LinearFeedback(Corrections):
    """Corrects each vehicle by a linear form in six of its signals. Not in the paper.

    delta = 5 m/s2 times the weighted sum of the scaled signals: gap error, speed ahead minus own, desired speed minus
    own, predecessor's acceleration, speed of the nearest disbanded vehicle ahead (a broadcast) minus own, and the plain
    law's command. `weights` is (2, 6), leaders first, or (B, 2, 6) with one set per episode. A
    weight can also be given by its name, such as `leader.gap_error`.

    Raises:
        ValueError: `weights` has another shape.
    """

    def __init__(self, spec: RoleSpec, weights: FloatArray | None = None, **numbers: float) -> None:
        super().__init__(spec, **{name: value for name, value in numbers.items() if name not in COEFFICIENTS})
        self.weights = np.array(shipped_weights() if weights is None else weights, dtype=np.float64)
        self.searched_numbers = self.weights.size if weights is None else 0
        if self.weights.shape[-2:] != SHAPE:
            raise ValueError(f"weights of shape {SHAPE} or (B, *{SHAPE}) were expected, got {self.weights.shape}")
        for name in numbers.keys() & set(COEFFICIENTS):
            self.weights.reshape(-1, len(COEFFICIENTS))[:, COEFFICIENTS.index(name)] = numbers[name]

    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """See the class."""
        config = self.spec.config
        weights = self.weights.reshape(-1, *SHAPE)
        known = (seen["desired_gap_m"], config.vehicles_per_platoon, config.headway_s, config.desired_speed_mps)
        _feed_back(seen.observation, self.layout, reasons, *known, weights, SCALES, corrections)


@kernel
def _feed_back(
    observation: Observation,
    layout: Layout,
    reasons: BoolArray,
    desired_gap_m: FloatArray,
    vehicles_per_platoon: int,
    headway_s: float,
    desired_speed_mps: float,
    weights: FloatArray,
    scales: FloatArray,
    corrections: FloatArray,
) -> None:
    sight, signals = sight_for(corrections.shape[1]), np.empty(scales.size)
    for b in range(corrections.shape[0]):
        look(borrowed(observation)[b], lend(layout), borrowed(reasons)[b], sight)
        for q in range(1, corrections.shape[1]):
            if sight.mitigable[q]:
                leads, speed = q % vehicles_per_platoon == 0, sight.speed[q]
                signals[0] = sight.gap[q] - (headway_s * speed if leads else desired_gap_m[b])
                signals[1] = sight.relative_speed[q]
                signals[2] = desired_speed_mps - speed
                signals[3] = sight.acceleration[q - 1]
                signals[4] = sight.ahead_speed[q] - speed
                signals[5] = sight.law_command[q]
                total = 0.0
                for k in range(scales.size):
                    total += weights[b % len(weights), 0 if leads else 1, k] * (signals[k] / scales[k])
                corrections[b, q] = GAIN_MPS2 * total
