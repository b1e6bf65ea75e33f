"""An attack beyond the paper that holds what MTD2 checks just below its threshold."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.replacing import attack_age, elapsed_steps
from cps_baselines.hvac.stealthy import MAX_BIAS_C
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.sensors import sensor_sets


class Brink(AnalyticPolicy):
    """Shows each zone colder, or `warmer`, by a bias that grows as fast as MTD2 tolerates.

    The set of the sensor alone is to keep passing: its residual at k + 1 may be what its mean residual (4.33) leaves,
    e^2 = (n + 1) (eps - margin) - n Jm, at most `most` eps. Its residual now is J = (y - xh)^2, so that
    b(k + 1) = b(k) + gain (e - sqrt(J)). Sets of several compromised sensors fail, as with a ramp; the others are
    intact. A smaller gain suits actions that are held for several steps.
    Each number may be an array (B,), one for each episode.

    Raises:
        ConfigurationError: an attacker that does not see the residuals or cannot show the truth minus a bias, sensors
            that are no set of their own, or a margin, gain or bound that makes no sense.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        margin_c2: float | FloatArray = 0.01,
        gain: float | FloatArray = 1.0,
        most: float | FloatArray = 2.0,
        warmer: bool = False,
    ) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        inside = (np.min(margin_c2) >= 0) & (np.max(margin_c2) < self.config.threshold_c2)
        if not (inside and 0 < np.min(gain) <= np.max(gain) <= 1 and np.min(most) > 0):
            raise ConfigurationError(
                f"margin_c2 = {margin_c2}, gain = {gain}, most = {most}: the margin has to lie in "
                f"[0, {self.config.threshold_c2}), the gain in (0, 1], the bound above 0"
            )
        if self.config.attacker_view != "white" or self.config.attack_action != "any":
            raise ConfigurationError('brink needs attacker_view="white" and attack_action="any"')
        self.margin_c2, self.gain, self.most = (np.reshape(each, (-1, 1)) for each in (margin_c2, gain, most))
        self._sign = -1.0 if warmer else 1.0
        self._alone = _sets_of_one(self.config)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The sizes of the biases (B, S), C."""
        return (np.zeros((len(generators), self.config.num_sensors)),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S + 1)."""
        (bias_c,) = state
        samples = elapsed_steps(seen, self.config) - self.config.window_steps + 1
        error_c = np.sqrt(self.in_c2(seen["residual"][:, self._alone]))
        allowed_c = self._allowed_c(samples, self.in_c2(seen["mean_residual"][:, self._alone]))
        growing = (attack_age(seen, self.config) > 0) & (samples > 0)
        grown = np.minimum(np.maximum(bias_c + self.gain * (allowed_c - error_c), 0.0), MAX_BIAS_C)
        bias_c = np.where(growing[:, np.newaxis] & (seen["compromised"] > 0.5), grown, bias_c)
        return bias_action(self.config, self._sign * bias_c), (bias_c,)

    def _allowed_c(self, samples: IntArray, mean_c2: FloatArray) -> FloatArray:
        """The error (B, S), C, that each sensor may have at the next step."""
        samples = np.maximum(samples, 0)[:, np.newaxis]
        eps = self.config.threshold_c2
        left = (samples + 1) * (eps - self.margin_c2) - samples * mean_c2
        allowed: FloatArray = np.sqrt(np.minimum(np.maximum(left, 0.0), self.most * eps))
        return allowed

    def in_c2(self, level: FloatArray) -> FloatArray:
        """Residuals in C2, any shape, from those of the observation, ln(1 + J / eps)."""
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
