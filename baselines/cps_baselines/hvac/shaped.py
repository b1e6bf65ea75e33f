"""An attack with numbers to be searched: how the bias grows, how far, when it begins, and how it is shared."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_baselines.hvac.stealthy import MAX_BIAS_C, ROOT_C_PER_H, UNIT_H, Stealthy
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray, IntArray, State
from cps_envs.hvac.sensors import zones_of_sensors


class Shaped(Stealthy):
    """Lies by a ramp with delay and cap: b_s = min(cap, 10 r (max(tau - delay, 0) / 10 h)^p) w_zone(s).

    `w1` to `w4` are the weights of zones 1 to 4, within [-1, 1]; a negative one turns the sign, and further zones have
    the weights again from the first. Forged sensors show the bias without noise, or with `keep_noise`.

    Raises:
        ConfigurationError: a rate, cap or delay below 0, an exponent that is not positive, or a weight beyond 1,
            besides what all stealthy attacks refuse.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        rate_c_per_h: float = ROOT_C_PER_H,
        exponent: float = 0.5,
        cap_c: float = MAX_BIAS_C,
        delay_h: float = 0.0,
        w1: float = 1.0,
        w2: float = 1.0,
        w3: float = 1.0,
        w4: float = 1.0,
        keep_noise: bool = False,
        warmer: bool = False,
    ) -> None:
        super().__init__(spec, keep_noise=keep_noise, warmer=warmer)
        weights = (w1, w2, w3, w4)
        _check(min(rate_c_per_h, cap_c, delay_h), exponent, weights)
        self.rate_c_per_h, self.exponent, self.cap_c, self.delay_h = rate_c_per_h, exponent, cap_c, delay_h
        self.weights: FloatArray = np.array(weights)[zones_of_sensors(self.config) % len(weights)]  # (S,)

    def bias_c(self, seen: Seen, age: IntArray, state: State | None) -> FloatArray:
        """That of each sensor; negative where its weight is."""
        tau_h = np.maximum(age * self.config.step_s / 3600.0 - self.delay_h, 0.0)
        grown = self.rate_c_per_h * UNIT_H * (tau_h / UNIT_H) ** self.exponent
        bias: FloatArray = np.minimum(grown, self.cap_c)[:, np.newaxis] * self.weights
        return bias


def _check(least: float, exponent: float, weights: Sequence[float]) -> None:
    if not (least >= 0 and exponent > 0 and all(-1 <= weight <= 1 for weight in weights)):
        raise ConfigurationError(
            "a shaped attack needs rate_c_per_h, cap_c and delay_h of at least 0, an exponent above 0 and weights "
            f"within [-1, 1]; got a smallest number {least}, the exponent {exponent} and the weights {list(weights)}"
        )
