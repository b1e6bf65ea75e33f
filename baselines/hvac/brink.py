"""An attack beyond the paper that holds what MTD2 checks just below its threshold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.hvac.clock import Clock
from baselines.hvac.stealthy import MAX_BIAS_C
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.observation import MAX_LOG
from cps_envs.hvac.sensors import sensor_sets


class Brink(AnalyticPolicy):
    """Every compromised sensor shows its zone colder by a bias that grows as fast as MTD2 lets it.

    The set of the sensor alone is to keep passing: its residual at k + 1 may be what its mean residual (4.33) leaves,
    e^2 = (n + 1) (eps - margin) - n Jm, at most `most` eps. Its residual now is J = (y - xh)^2, so that
    b(k + 1) = b(k) + gain (e - sqrt(J)). Sets of several compromised sensors fail, as with a ramp; the others are
    intact. A smaller gain suits actions that are held for several steps.

    Raises:
        ConfigurationError: an attacker that does not see the residuals or cannot show the truth minus a bias, sensors
            that are no set of their own, or a margin, gain or bound that makes no sense.
    """

    def __init__(self, spec: RoleSpec, *, margin_c2: float = 0.01, gain: float = 1.0, most: float = 2.0) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        if not (0 <= margin_c2 < self.config.threshold_c2 and 0 < gain <= 1 and most > 0):
            raise ConfigurationError(
                f"margin_c2 = {margin_c2}, gain = {gain}, most = {most}: the margin has to lie in "
                f"[0, {self.config.threshold_c2}), the gain in (0, 1], the bound above 0"
            )
        if self.config.attacker_view != "white" or self.config.attack_action != "any":
            raise ConfigurationError('brink needs attacker_view="white" and attack_action="any"')
        self.margin_c2, self.gain, self.most = margin_c2, gain, most
        alone = _sets_of_one(self.config)
        self._compromised = spec.fields.slices["compromised"]
        self._residual, self._mean = (spec.fields.slices[name].start + alone for name in ("residual", "mean_residual"))
        self._age, self._now = Clock(spec, "attack_h"), Clock(spec, "elapsed_h")

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """The biases (B, S), C."""
        return (np.zeros((len(generators), self.config.num_sensors)),)

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """Actions (B, S + 1)."""
        bias_c = np.zeros((len(observation), self.config.num_sensors)) if state is None else state[0]
        error_c = np.sqrt(self._c2(observation[:, self._residual]))
        growing = (self._age(observation) > 0) & (self._now(observation) >= self.config.window_steps)
        grown = np.clip(bias_c + self.gain * (self._allowed_c(observation) - error_c), 0.0, MAX_BIAS_C)
        bias_c = np.where(growing[:, np.newaxis] & (observation[:, self._compromised] > 0), grown, bias_c)
        return bias_action(self.config, bias_c), (bias_c,)

    def _allowed_c(self, observation: Array) -> FloatArray:
        """The error (B, S), C, that each sensor may have at the next step."""
        samples = np.maximum(self._now(observation) - self.config.window_steps + 1, 0)[:, np.newaxis]
        eps = self.config.threshold_c2
        left = (samples + 1) * (eps - self.margin_c2) - samples * self._c2(observation[:, self._mean])
        allowed: FloatArray = np.sqrt(np.clip(left, 0.0, self.most * eps))
        return allowed

    def _c2(self, shown: Array) -> FloatArray:
        """Residuals as observed, in C2."""
        level = 0.5 * MAX_LOG * (shown.astype(np.float64) + 1.0)
        residual: FloatArray = self.config.threshold_c2 * np.expm1(level)
        return residual


def _sets_of_one(config: HvacConfig) -> IntArray:
    """The place (S,) of each sensor alone among the sets."""
    sets = sensor_sets(config)
    wanted = [(sensor,) for sensor in range(1, config.num_sensors + 1)]
    missing = [str(sensors[0]) for sensors in wanted if sensors not in sets]
    if missing:
        raise ConfigurationError(
            f"brink needs a set of each sensor alone; sensor_sets lacks that of {', '.join(missing)}"
        )
    return np.array([sets.index(sensors) for sensors in wanted])
