"""Players for the tests: square wave (sampled by averages over each hold), closed loop, and disbanding defence."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policy import AnalyticPolicy, State
from cps_envs.core.types import Array, BoolArray, FloatArray
from cps_envs.rogue.actions import MODIFIED, PLAIN, action_of_effort
from cps_envs.rogue.laws import LAWS


class Square(AnalyticPolicy):
    """F+ in the first half of each period and F- in the second; a hold in which it switches gets the mean effort."""

    def __init__(self, spec, frequency_hz=0.1, duty=0.5) -> None:
        super().__init__(spec)
        self.frequency_hz, self.duty = np.asarray(frequency_hz, float), duty

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        config, hold_s = self.spec.config, self.spec.decision_interval_s
        seen = self.spec.fields.decode(observation)
        begin_s = np.round((config.duration_s - seen["time_left_s"]) / hold_s) * hold_s
        share = np.clip((self._driving_s(begin_s + hold_s) - self._driving_s(begin_s)) / hold_s, 0, 1)
        effort = config.min_effort + share * (config.max_effort - config.min_effort)
        return action_of_effort(effort, seen["speed"], seen["power_ratio"], config)[:, np.newaxis], state

    def _driving_s(self, time_s: FloatArray) -> FloatArray:
        """Time at F+ from 0 on."""
        phase = self.frequency_hz * time_s
        return (np.floor(phase) * self.duty + np.minimum(phase % 1, self.duty)) / self.frequency_hz


class Switching(AnalyticPolicy):
    """Full effort with the sign of a linear form in five signals, with hysteresis (specification 4.7)."""

    def __init__(self, spec, weights) -> None:
        super().__init__(spec)
        self.weights = np.asarray(weights, float)

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        seen, sigma = self.spec.fields.decode(observation), self.spec.config.separation_m
        signals = (
            seen["front_gap_error"] / sigma,
            seen["front_gap_rate"] / 5,
            seen["rear_gap_error"] / sigma,
            seen["rear_gap_rate"] / 5,
            (seen["speed"] - seen["reference_speed"]) / 10,
            np.ones(len(observation)),
        )
        form = np.stack(signals, axis=1) @ self.weights[:6]
        before = np.ones(len(observation)) if state is None else np.where(episode_start, 1.0, state[0])
        sign = np.where(np.abs(form) > abs(self.weights[6]), np.sign(form), before)
        return sign[:, np.newaxis], (sign,)


class Disband(AnalyticPolicy):
    """The modified law, and human drivers for all from the moment in which one's growth reaches the threshold."""

    def __init__(self, spec, threshold_m=7.0) -> None:
        super().__init__(spec)
        count, self.threshold_m = spec.config.num_intact, threshold_m
        self.together = np.tile([LAWS.index("detecting"), MODIFIED], count)
        self.apart = np.tile([LAWS.index("human"), PLAIN], count)

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        seen, config = self.spec.fields.decode(observation), self.spec.config
        everyone = np.arange(config.num_vehicles)
        intact = np.delete(everyone, config.attacker_index - 1)
        none = np.full((len(observation), 1), np.inf)
        front = np.hstack([seen["gap_error"], seen["reference_error"][:, np.newaxis]])[:, intact]
        rear = np.hstack([none, seen["gap_error"]])[:, intact]
        error = np.where(seen["alarm"] > 0.5, front, rear) - seen["growth"]
        ready = (np.abs(seen["alarm"]) > 0.5) & (np.abs(error) < config.inner_share * config.separation_m)
        last = ready & (seen["growth"] + config.growth_step_m > self.threshold_m - 1e-3)
        now = last.any(axis=1) | (seen["law"][:, :, LAWS.index("human")] > 0.5).any(axis=1)
        return np.where(now[:, np.newaxis], self.apart, self.together), state
