"""Extension beyond the paper: linear feedback with coefficients found by a seeded search (`feedback_search`)."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files

import numpy as np

from baselines.disbanding.corrections import Corrections, Seen
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray

SIGNALS = ("gap_error", "relative_speed", "speed_deficit", "predecessor_acceleration", "ahead_speed", "law_command")
SCALES = np.array([10.0, 10.0, 10.0, 5.0, 10.0, 5.0])  # m, m/s, m/s, m/s2, m/s, m/s2
GAIN_MPS2 = 5.0
SHAPE = (2, len(SIGNALS))  # leaders, others


@lru_cache(maxsize=1)
def shipped_weights() -> FloatArray:
    """The coefficients (2, 6) that come with the package: of platoon leaders, then of all others."""
    text = files("baselines.disbanding").joinpath("feedback.json").read_text(encoding="utf-8")
    return np.array(json.loads(text)["weights"], dtype=np.float64)


class LinearFeedback(Corrections):
    """Extension beyond the paper: each vehicle's correction is linear in six of its signals.

    delta = 5 m/s2 times the weighted sum of the scaled signals: gap error, speed ahead minus own, desired speed minus
    own, predecessor's acceleration, speed of the nearest disbanded vehicle ahead (a broadcast) minus own, and the plain
    law's command. `weights` is (2, 6), leaders first, or (B, 2, 6) with one set per episode.

    Raises:
        ValueError: `weights` has another shape.
    """

    def __init__(self, spec: RoleSpec, weights: FloatArray | None = None) -> None:
        super().__init__(spec)
        self.weights = np.asarray(shipped_weights() if weights is None else weights, dtype=np.float64)
        if self.weights.shape[-2:] != SHAPE:
            raise ValueError(f"weights of shape {SHAPE} or (B, *{SHAPE}) were expected, got {self.weights.shape}")
        size = spec.config.vehicles_per_platoon
        self.leads = np.arange(spec.config.max_vehicles) % size == 0

    def corrections(self, seen: Seen) -> FloatArray:
        """See the class."""
        scaled = self.signals(seen) / SCALES
        weights = np.where(self.leads[:, np.newaxis], self.weights[..., :1, :], self.weights[..., 1:, :])
        corrections: FloatArray = GAIN_MPS2 * np.sum(weights * scaled, axis=-1)
        return corrections

    def signals(self, seen: Seen) -> FloatArray:
        """The six signals (B, M, 6) in physical units; those of the front vehicle are of no use."""
        config = self.spec.config
        speed = seen["speed"]
        behind = ((0, 0), (1, 0))
        desired = np.where(self.leads, config.headway_s * speed, seen["desired_gap_m"][:, np.newaxis])
        return np.stack(
            [
                np.pad(seen["gap"], behind) - desired,
                np.pad(seen["relative_speed"], behind),
                config.desired_speed_mps - speed,
                np.pad(seen["acceleration"][:, :-1], behind),
                self.by_vehicle(seen["ahead_speed"], seen) - speed,
                seen["law_command"],
            ],
            axis=-1,
        )
