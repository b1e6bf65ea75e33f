"""Attacks beyond the paper that grow slowly enough for the observer to follow: ramps, and mimicry of unknown heat."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from cps_baselines.hvac.replacing import attack_age
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.building import discretise
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.sensors import zones_of_sensors

# The strongest ramps that MTD2 follows.
NOISELESS_C_PER_H, NOISY_C_PER_H = 0.7, 0.5  # without the sensor's own noise, and with it
EVERYWHERE_C_PER_H = 2.0  # where no sensor is intact
ROOT_C_PER_H = 2.0  # against MTD1, with the exponent 0.5
UNIT_H = 10.0  # age at which a ramp of any exponent has risen by `rate` times this
MAX_BIAS_C = 15.0


class Stealthy(AnalyticPolicy):
    """Base: every compromised sensor shows its zone colder than it is, or `warmer`, by a bias of at most 15 C.

    The bias is taken from the true temperature, or with `keep_noise` from the sensor's own noisy reading.

    Raises:
        ConfigurationError: a bias without noise where the configuration's attacker only adds to its own readings.
    """

    def __init__(self, spec: RoleSpec, *, keep_noise: bool = False, warmer: bool = False) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        self.keep_noise = keep_noise
        self._sign = -1.0 if warmer else 1.0
        if not keep_noise and self.config.attack_action == "bias":
            raise ConfigurationError(
                'attack_action="bias" leaves the noise in forged readings: name the policy with keep_noise=true'
            )

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, S + 1), or (B, S) with `attack_action="bias"`."""
        bias_c = np.minimum(self.bias_c(seen, attack_age(seen, self.config), state), MAX_BIAS_C)
        return bias_action(self.config, self._sign * bias_c, keep_noise=self.keep_noise), state

    @abstractmethod
    def bias_c(self, seen: Seen, age: IntArray, state: Any) -> FloatArray:
        """Sizes of the biases (B, S) or (B, 1), C, at `age` (B,) steps after the onset."""


class Ramp(Stealthy):
    """Lies by a bias that grows with time: b = 10 r (tau / 10 h)^p, r in C/h. A straight ramp where p = 1.

    Without a rate it is the strongest that MTD2 follows: 0.7 C/h, with `keep_noise` 0.5 C/h, and 2 C/h where all
    sensors are compromised. A rate given as a pair (low, high) is drawn uniformly for each episode.

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
        warmer: bool = False,
    ) -> None:
        super().__init__(spec, keep_noise=keep_noise, warmer=warmer)
        self.rate_c_per_h, self.exponent = rate_c_per_h, exponent
        self._low, self._high = _ends(rate_c_per_h)
        if not (0 < self._low <= self._high and exponent > 0):
            raise ConfigurationError(
                f"a ramp needs a positive rate in C/h, or a pair (low, high), and a positive exponent; got "
                f"{rate_c_per_h} and {exponent}"
            )

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The rate (B,) of each episode, C/h; without one, 1."""
        return (np.array([generator.uniform(self._low, self._high) for generator in generators]),)

    def bias_c(self, seen: Seen, age: IntArray, state: State) -> FloatArray:
        """The same for all sensors of an episode."""
        rate = state[0]
        if self.rate_c_per_h is None:
            everything = seen["compromised"].min(axis=1) > 0.5
            rate = np.where(everything, EVERYWHERE_C_PER_H, NOISY_C_PER_H if self.keep_noise else NOISELESS_C_PER_H)
        tau_h = age * self.config.step_s / 3600.0
        bias: FloatArray = (rate * UNIT_H * (tau_h / UNIT_H) ** self.exponent)[:, np.newaxis]
        return bias


def _ends(rate: float | Sequence[float] | None) -> tuple[float, float]:
    """The interval of a rate; without one, of the factor 1."""
    if isinstance(rate, Sequence):
        return (float(rate[0]), float(rate[1])) if len(rate) == 2 else (0.0, 0.0)
    return (1.0, 1.0) if rate is None else (rate, rate)


def root_ramp(
    spec: RoleSpec, rate_c_per_h: float = ROOT_C_PER_H, *, keep_noise: bool = False, warmer: bool = False
) -> Ramp:
    """Lies by b = 20 C (tau / 10 h)^0.5, the ramp for MTD1: MTD1 compares sets by their newest reading only."""
    return Ramp(spec, rate_c_per_h, exponent=0.5, keep_noise=keep_noise, warmer=warmer)


class HeatLossMimic(Stealthy):
    """Shows readings as if every zone lost `loss_w` from the onset on: b(k + 1) = A b(k) + B loss.

    With `warmer`, as if every zone gained it.

    Raises:
        ConfigurationError: a negative loss, besides what all stealthy attacks refuse.
    """

    def __init__(
        self, spec: RoleSpec, loss_w: float = 100.0, *, keep_noise: bool = False, warmer: bool = False
    ) -> None:
        super().__init__(spec, keep_noise=keep_noise, warmer=warmer)
        if not loss_w >= 0:
            raise ConfigurationError(f"loss_w = {loss_w} must not be negative; warmer=true shows a gain of heat")
        self.loss_w = loss_w
        by_zone = loss_response(self.config, loss_w)
        self._bias_c = by_zone[:, zones_of_sensors(self.config)]

    def bias_c(self, seen: Seen, age: IntArray, state: State | None) -> FloatArray:
        """That of each sensor's zone."""
        bias: FloatArray = self._bias_c[age]
        return bias


def loss_response(config: HvacConfig, loss_w: float | FloatArray) -> FloatArray:
    """How much colder (K, n), C, the zones are 0..K-1 steps after every one began to lose `loss_w`, or (n,) of it."""
    building = discretise(config)
    colder = np.zeros((config.num_steps, config.num_zones))
    for k in range(1, config.num_steps):
        colder[k] = building.A @ colder[k - 1] + building.B * loss_w
    return colder
