"""Defenders that compare readings with one another, step by step, and the base of all that decide which to use.

They are extensions beyond the paper, which has no defender.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from cps_envs.core.compute.kernels import inlined, kernel
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, plays_in, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, State
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.filtered import MAX_RATE_MPS

ROUNDING = 1e-3  # m and m/s; observations are of single precision


class Detector(AnalyticPolicy):
    """Base: distrusted readings are replaced from the next step on; commands are never corrected.

    Raises:
        ConfigurationError: the configuration has a filter, so that sensors are noisy.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config
        if self.config.estimator == "kalman":
            raise ConfigurationError(
                f"{type(self).__name__} is for exact sensors, as in preset paper: it would doubt noise. "
                f'With estimator = "kalman" use chi2, cusum or bank'
            )

    @abstractmethod
    def blank(self, envs: int) -> Array:
        """What is remembered of an episode at its start: zeros (B, ...)."""

    @abstractmethod
    def judge(self, seen: Seen, memory: Array, actions: IntArray) -> None:
        """Renew what is remembered (B, ...), and set the trust of readings that are not to be used to 0.

        The memory of an episode that begins, see `seen.start`, counts as blank. Actions (B, 3n) trust every reading
        before: ranges of vehicles 1..n, then range-rates.
        """

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, 3n): trust in every reading, then no correction."""
        memory = self.blank(len(seen)) if state is None else state[0].copy()
        actions = repeat(self.spec.neutral_action, len(seen))
        self.judge(seen, memory, actions)
        return actions, (memory,)


HOLD_S = 2.0  # chosen


@plays_in("paper")
class KinematicResidual(Detector):
    """Rejects both readings of a vehicle when its range does not change at the measured rate.

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

    def judge(self, seen: Seen, memory: Array, actions: IntArray) -> None:
        """See the class."""
        layout = (seen.fields.offsets, seen.fields.scale)
        _compare_changes(seen.observation, seen.start, *layout, self.threshold_m, self.hold_steps, memory, actions)


@plays_in("paper")
class FrontRearRedundancy(Detector):
    """Replaces a range by the rear sensor of the vehicle ahead when the two differ.

    The difference is the injection itself, so half a resolution decides, and the range is used again after `hold_s`
    without difference. It needs communication between neighbours, which the paper's controller avoids. The lead's
    range and all range-rates have no second sensor.

    Raises:
        ConfigurationError: a negative time.
    """

    def __init__(self, spec: RoleSpec, *, hold_s: float = HOLD_S) -> None:
        super().__init__(spec)
        self.hold_steps = hold_steps(self.config, hold_s)

    def blank(self, envs: int) -> IntArray:
        """Steps (B, n - 1) for which a range stays doubted."""
        return np.zeros((envs, self.config.num_vehicles - 1), np.int64)

    def judge(self, seen: Seen, memory: Array, actions: IntArray) -> None:
        """See the class."""
        layout, largest_m = (seen.fields.offsets, seen.fields.scale), self.config.range_resolution_m / 2
        _compare_sensors(seen.observation, seen.start, *layout, largest_m, self.hold_steps, memory, actions)


class ModelOnly(AnalyticPolicy):
    """Replaces every reading at every step. A reference: it sees neither attacks nor disturbances."""

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, R + n)."""
        action = self.spec.neutral_action.copy()
        action[: self.spec.config.num_readings] = 0
        return repeat(action, len(seen)), state


@kernel
def _compare_changes(
    observation: Observation,
    start: BoolArray,
    offsets: Array,
    scale: FloatArray,
    threshold_m: float,
    hold_steps: int,
    memory: FloatArray,
    actions: IntArray,
) -> None:
    """`KinematicResidual.judge` on observations (B, size) whose fields begin at `offsets`."""
    n, at = memory.shape[1], offsets[0]
    for b in range(memory.shape[0]):
        for i in range(n):
            residual = decode_entry(observation[b], scale, at.kinematic_residual + i)
            left, offset = (0.0, 0.0) if start[b] else (memory[b, i, 0], memory[b, i, 1])
            left = latched(abs(residual) > threshold_m, left, hold_steps)
            doubted = left > 0 or abs(offset) > threshold_m
            offset = offset + residual if doubted else 0.0
            memory[b, i, 0], memory[b, i, 1] = left, offset
            actions[b, i] = not (left > 0 or abs(offset) > threshold_m)
            actions[b, n + i] = not left > 0


@kernel
def _compare_sensors(
    observation: Observation,
    start: BoolArray,
    offsets: Array,
    scale: FloatArray,
    largest_m: float,
    hold_steps: int,
    memory: IntArray,
    actions: IntArray,
) -> None:
    """`FrontRearRedundancy.judge` on observations (B, size) whose fields begin at `offsets`."""
    at = offsets[0]
    for b in range(memory.shape[0]):
        for i in range(memory.shape[1]):
            difference = decode_entry(observation[b], scale, at.redundancy_residual + i)
            memory[b, i] = latched(abs(difference) > largest_m, 0 if start[b] else memory[b, i], hold_steps)
            actions[b, i] = not memory[b, i] > 0


@inlined
def latched(raised: bool, left: float, steps: int) -> float:
    """For how many steps, this one included, an alarm stays on: `steps` more where raised, else one less."""
    return steps + 1 if raised else max(left - 1, 0)


def hold_steps(config: FdiConfig, hold_s: float) -> int:
    """For how many steps an alarm holds after the one that raised it.

    Raises:
        ConfigurationError: a negative time.
    """
    if hold_s < 0:
        raise ConfigurationError(f"hold_s = {hold_s} must be 0 or more")
    return round(hold_s / config.dt_s)


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
