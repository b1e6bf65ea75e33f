"""Defenders that compare readings with one another; extensions beyond the paper, which has no defender."""

from __future__ import annotations

import numpy as np

from baselines.fdi.detector import ROUNDING, Detector, Seen
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.fields import MAX_RATE_MPS

HOLD_S = 2.0  # chosen


class KinematicResidual(Detector):
    """Doubts both readings of a vehicle whose range does not change as its range-rate says.

    It needs nothing but a vehicle's own two sensors, and cannot tell which of them is false. The range-rate is used
    again after `hold_s` without alarm; the range when, besides, the residuals since the alarm add up to nothing, since
    a constant offset leaves no residual after its onset. An attack on the range-rate alone therefore costs the range
    for the rest of the episode; it is replaced by what the range-rate and the model give. Blind to offsets of the
    range that are there from the first reading on, and to attacks on both sensors that agree with each other.

    Raises:
        ConfigurationError: a negative time.
    """

    def __init__(self, spec: RoleSpec, *, hold_s: float = HOLD_S) -> None:
        super().__init__(spec)
        self.hold_steps = hold_steps(self.config, hold_s)
        self.threshold_m = quiet_residual_m(self.config) + ROUNDING

    def blank(self, envs: int) -> FloatArray:
        """For each vehicle (B, n, 2): steps for which the alarm still holds, and the residuals since then, m."""
        return np.zeros((envs, self.config.num_vehicles, 2))

    def distrust(self, seen: Seen, memory: Array) -> tuple[BoolArray, Array]:
        """See the class."""
        residual, (left, offset) = seen["kinematic_residual"], np.moveaxis(memory, -1, 0)
        raised = np.abs(residual) > self.threshold_m
        left = latched(raised, left, self.hold_steps)
        doubted = (left > 0) | (np.abs(offset) > self.threshold_m)
        offset = np.where(doubted, offset + residual, 0.0)
        ranges = (left > 0) | (np.abs(offset) > self.threshold_m)
        return np.concatenate([ranges, left > 0], axis=1), np.stack([left, offset], axis=-1)


class FrontRearRedundancy(Detector):
    """Doubts a range that differs from what the rear sensor of the vehicle ahead measures; it then takes that one.

    The difference is the injection itself, so half a resolution decides, and the range is used again after `hold_s`
    without difference. It needs communication between neighbours, which the paper's controller avoids. The lead's
    range and all range-rates have no second sensor.

    Raises:
        ConfigurationError: the defender does not see the rear sensors, or a negative time.
    """

    def __init__(self, spec: RoleSpec, *, hold_s: float = HOLD_S) -> None:
        super().__init__(spec)
        self.hold_steps = hold_steps(self.config, hold_s)
        if not self.config.share_rear_range:
            raise ConfigurationError(f"{type(self).__name__} compares range sensors: it needs share_rear_range=True")

    def blank(self, envs: int) -> IntArray:
        """Steps (B, n - 1) for which a range stays doubted."""
        return np.zeros((envs, self.config.num_vehicles - 1), np.int64)

    def distrust(self, seen: Seen, memory: Array) -> tuple[BoolArray, Array]:
        """See the class."""
        raised = np.abs(seen["redundancy_residual"]) > self.config.range_resolution_m / 2
        left = latched(raised, memory, self.hold_steps)
        return np.pad(left > 0, ((0, 0), (0, self.config.num_vehicles + 1))), left


class ModelOnly(AnalyticPolicy):
    """Replaces every reading at every step: a reference, as blind to attacks as to disturbances."""

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """Actions (B, 3n)."""
        action = self.spec.neutral_action.copy()
        action[: 2 * self.spec.config.num_vehicles] = 0
        return np.stack([action] * len(observation)), state


def hold_steps(config: FdiConfig, hold_s: float) -> int:
    """For how many steps an alarm holds after the one that raised it.

    Raises:
        ConfigurationError: a negative time.
    """
    if hold_s < 0:
        raise ConfigurationError(f"hold_s = {hold_s} must be 0 or more")
    return round(hold_s / config.dt_s)


def latched(raised: BoolArray, left: Array, steps: int) -> Array:
    """The steps, this one included, for which alarms stay on: `steps` more where raised, else one less than before."""
    return np.where(raised, steps + 1, np.maximum(left - 1, 0))


def quiet_residual_m(config: FdiConfig) -> float:
    """What the kinematic residual (m) does not exceed without attack while commands are within the limits.

    The trapezoidal rule is exact while accelerations are held over the step ("zohu"). The closed loop ("zoh") moves
    commands within it: its error is at most dt^3/12 times the largest change of relative acceleration per second. The
    forward Euler step leaves dt^2/2 times the relative acceleration.
    """
    largest = max(config.max_acceleration_mps2, -config.min_acceleration_mps2)
    if config.discretisation == "zohu":
        return 0.0
    if config.discretisation == "euler":
        return 2 * largest * config.dt_s**2 / 2
    n, k_p, k_d = config.num_vehicles, config.proportional_gain, config.derivative_gain
    behind, ahead = np.eye(n) - np.eye(n, k=-1), np.eye(n, k=1) - np.eye(n)  # L and D
    by_rate = np.abs(k_p * ahead @ behind).sum(axis=1).max() * MAX_RATE_MPS
    by_command = np.abs(k_d * ahead @ behind @ ahead).sum(axis=1).max() * largest
    return float(config.dt_s**3 / 12 * (by_rate + by_command))
