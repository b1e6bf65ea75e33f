"""Attacks beyond the paper that grow slowly enough for the observer to follow: a ramp, and the mimicry of a heat loss."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.hvac.seen import Clock, read_field
from cps_envs.core.config import bounds
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.building import discretise
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.sensors import zones_of_sensors

SOME_C_PER_H, ALL_C_PER_H = 0.7, 2.0  # the strongest ramps that MTD2 follows: intact sensors left, none left
ROOT_C_PER_H = 2.0  # against MTD1, with the exponent 0.5
UNIT_H = 10.0  # age at which a ramp of any exponent has risen by `rate` times this
MAX_BIAS_C = 15.0


class Stealthy(AnalyticPolicy):
    """Base: every compromised sensor shows its zone colder than it is, by a bias within [0, 15] C.

    The bias is taken from the true temperature, or with `keep_noise` from the sensor's own noisy reading.

    Raises:
        ConfigurationError: a bias without noise where the configuration's attacker only adds to its own readings.
    """

    def __init__(self, spec: RoleSpec, *, keep_noise: bool = False) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        self.keep_noise = keep_noise
        if not keep_noise and self.config.attack_action == "bias":
            raise ConfigurationError(
                'attack_action="bias" leaves the noise in forged readings: name the policy with keep_noise=true'
            )
        self._age = Clock(spec, "attack_h")

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """Actions (B, S + 1), or (B, S) with `attack_action="bias"`."""
        if state is None:
            state = self.begin([np.random.default_rng() for _ in observation], [{}] * len(observation))
        bias_c = np.clip(self.bias_c(observation, self._age(observation), state), 0.0, MAX_BIAS_C)
        shape = (len(observation), self.config.num_sensors)
        return bias_action(self.config, np.broadcast_to(bias_c, shape), keep_noise=self.keep_noise), state

    @abstractmethod
    def bias_c(self, observation: Array, age: IntArray, state: State) -> FloatArray:
        """Biases (B, S) or (B, 1), C, at `age` (B,) steps after the onset."""


class Ramp(Stealthy):
    """b = 10 r (tau / 10 h)^p with the rate r in C/h: a straight ramp r tau where p = 1.

    Without a rate it is the strongest that MTD2 follows: 0.7 C/h, and 2 C/h where all sensors are compromised. A rate
    given as a pair (low, high) is drawn uniformly for each episode.

    Raises:
        ConfigurationError: a rate or an exponent that is not positive, besides what all stealthy attacks refuse.
    """

    def __init__(
        self,
        spec: RoleSpec,
        rate_c_per_h: float | Sequence[float] | None = None,
        *,
        exponent: float = 1.0,
        keep_noise: bool = False,
    ) -> None:
        super().__init__(spec, keep_noise=keep_noise)
        self.rate_c_per_h, self.exponent = rate_c_per_h, exponent
        low, high = (1.0, 1.0) if rate_c_per_h is None else bounds(rate_c_per_h)
        if not (0 < low <= high and exponent > 0):
            raise ConfigurationError(
                f"a ramp needs a positive rate in C/h, or a pair (low, high), and a positive exponent; got "
                f"{rate_c_per_h} and {exponent}"
            )
        self._low, self._high = low, high
        self._compromised = read_field(spec.fields, "compromised")

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """The rate (B,) of each lane, C/h; without one, 1."""
        return (np.array([generator.uniform(self._low, self._high) for generator in generators]),)

    def bias_c(self, observation: Array, age: IntArray, state: State) -> FloatArray:
        """The same for all sensors of a lane."""
        assert state is not None
        rate = state[0]
        if self.rate_c_per_h is None:
            everything = self._compromised(observation).min(axis=1) > 0.5
            rate = np.where(everything, ALL_C_PER_H, SOME_C_PER_H)
        tau_h = age * self.config.step_s / 3600.0
        bias: FloatArray = (rate * UNIT_H * (tau_h / UNIT_H) ** self.exponent)[:, np.newaxis]
        return bias


def root_ramp(spec: RoleSpec, rate_c_per_h: float = ROOT_C_PER_H, *, keep_noise: bool = False) -> Ramp:
    """The ramp for MTD1, b = 20 C (tau / 10 h)^0.5: MTD1 compares sets by their newest reading only."""
    return Ramp(spec, rate_c_per_h, exponent=0.5, keep_noise=keep_noise)


class HeatLossMimic(Stealthy):
    """Readings as if every zone lost `loss_w` from the onset on, by the nominal model: b' = A b + B loss, b = 0 at first.

    Raises:
        ConfigurationError: a negative loss, besides what all stealthy attacks refuse.
    """

    def __init__(self, spec: RoleSpec, loss_w: float = 100.0, *, keep_noise: bool = False) -> None:
        super().__init__(spec, keep_noise=keep_noise)
        if not loss_w >= 0:
            raise ConfigurationError(
                f"loss_w = {loss_w} must not be negative: forged readings are colder than the truth"
            )
        self.loss_w = loss_w
        by_zone = loss_response(self.config, loss_w)
        self._bias_c = by_zone[:, zones_of_sensors(self.config)]

    def bias_c(self, observation: Array, age: IntArray, state: State) -> FloatArray:
        """That of each sensor's zone."""
        bias: FloatArray = self._bias_c[age]
        return bias


def loss_response(config: HvacConfig, loss_w: float) -> FloatArray:
    """How much colder (K, n), C, the zones are 0..K-1 steps after every one began to lose `loss_w`."""
    building = discretise(config)
    colder = np.zeros((config.num_steps, config.num_zones))
    for k in range(1, config.num_steps):
        colder[k] = building.A @ colder[k - 1] + building.B * loss_w
    return colder
