"""Attacks that replace readings by a signal of their own: a constant, a sine, or random values.

Time counts in whole steps, from the hours that an observation shows.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.config import HvacConfig


def attack_age(seen: Seen, config: HvacConfig) -> IntArray:
    """Steps (B,) from the onset to the readings that an attacker's action forges; 0 before."""
    return _steps(seen, "attack_h", config)


def elapsed_steps(seen: Seen, config: HvacConfig) -> IntArray:
    """Steps (B,) since midnight of the first day."""
    return _steps(seen, "elapsed_h", config)


def _steps(seen: Seen, name: str, config: HvacConfig) -> IntArray:
    steps: IntArray = np.rint(seen[name] * (3600.0 / config.step_s)).astype(np.int64)
    return steps


class Replacing(AnalyticPolicy):
    """Base: every compromised sensor shows what `readings` says, without noise.

    Raises:
        ConfigurationError: readings from `low_c` to `high_c` do not fit the sensors, or the configuration's attacker
            only adds biases.
    """

    def __init__(self, spec: RoleSpec, low_c: float, high_c: float) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        for reading_c in (low_c, high_c):
            absolute_action(self.config, np.array([[reading_c]]))

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, S + 1)."""
        return absolute_action(self.config, self.readings(seen, state)), state

    @abstractmethod
    def readings(self, seen: Seen, state: Any) -> FloatArray:
        """Readings (B, S) or (B, 1), C."""


class Constant(Replacing):
    """Makes compromised sensors read 22 C, so that the controller overheats the rooms: chapter 4's constant attack."""

    def __init__(self, spec: RoleSpec, reading_c: float = 22.0) -> None:
        super().__init__(spec, reading_c, reading_c)
        self.reading_c = reading_c
        self._action = absolute_action(self.config, np.array([[reading_c]]))

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The same action at all times, (B, S + 1)."""
        return self._action.repeat(len(seen), axis=0), state

    def readings(self, seen: Seen, state: State | None) -> FloatArray:
        """The same at all times."""
        return np.full((len(seen), 1), self.reading_c)


class Sine(Replacing):
    """Shows 22 + 3 sin(2 pi tau / 7200 s) C: chapter 4's sinusoidal attack, with calibrated numbers."""

    def __init__(
        self, spec: RoleSpec, mean_c: float = 22.0, amplitude_c: float = 3.0, period_s: float = 7200.0
    ) -> None:
        super().__init__(spec, mean_c - abs(amplitude_c), mean_c + abs(amplitude_c))
        if not period_s > 0:
            raise ConfigurationError(f"period_s = {period_s}: a sine needs a positive period")
        self.mean_c, self.amplitude_c, self.period_s = mean_c, amplitude_c, period_s

    def readings(self, seen: Seen, state: State | None) -> FloatArray:
        """The same for all sensors of an episode."""
        angle = 2.0 * np.pi * attack_age(seen, self.config) * self.config.step_s / self.period_s
        readings: FloatArray = (self.mean_c + self.amplitude_c * np.sin(angle))[:, np.newaxis]
        return readings


class RandomReadings(Replacing):
    """Shows random readings from 18 to 26 C at each step: chapter 4's random attack, with calibrated numbers.

    Raises:
        ConfigurationError: `low_c` above `high_c`, besides what all replacing attacks refuse.
    """

    def __init__(self, spec: RoleSpec, low_c: float = 18.0, high_c: float = 26.0) -> None:
        super().__init__(spec, low_c, high_c)
        if low_c > high_c:
            raise ConfigurationError(f"low_c = {low_c} is above high_c = {high_c}: swap them")
        self.low_c, self.high_c = low_c, high_c

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Readings (B, K, S), C, of the whole episode, counted from the onset."""
        shape = (self.config.num_steps, self.config.num_sensors)
        return (np.stack([generator.uniform(self.low_c, self.high_c, shape) for generator in generators]),)

    def readings(self, seen: Seen, state: State) -> FloatArray:
        """What was drawn for each sensor."""
        drawn: FloatArray = state[0][np.arange(len(seen)), attack_age(seen, self.config)]
        return drawn
