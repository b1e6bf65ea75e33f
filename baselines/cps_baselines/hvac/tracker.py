"""An attack that stays within what a Kalman filter takes for drift, with noise of its own."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.hypotheses import FilterChoices
from cps_baselines.hvac.replacing import attack_age, elapsed_steps
from cps_baselines.hvac.stealthy import MAX_BIAS_C
from cps_envs.core.declare.config import of_bodies
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, Knowledge, State
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import build_model


class Tracker(AnalyticPolicy):
    """Lies so that each forged sensor's innovation, without its noise, stays at `level` standard deviations.

    A forged reading is the truth, minus a bias, plus noise that the attacker draws itself: `noise` times that of a
    sensor. So it looks honest, and the attacker still knows the innovation without noise, r. It watches the filter that
    the defender followed last, or that of all sensors where the defender follows none or hides it, and grows it by
    b(k + 1) = b(k) + gain (level - r) sigma, towards colder readings or `warmer` ones, up to `cap_c`. The filter takes
    what is left for drifting heat. A CUSUM with a slack above `level` does not sum it up. Each number may be an array
    (B,) with that of each episode.

    Raises:
        ConfigurationError: an attacker that does not see the innovations or cannot show the truth minus a bias, a
            configuration without Kalman filters, or numbers that are not positive, the noise not negative.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        level: float | FloatArray = 0.4,
        gain: float | FloatArray = 0.5,
        noise: float | FloatArray = 1.0,
        cap_c: float | FloatArray = MAX_BIAS_C,
        warmer: bool = False,
    ) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        if self.config.attacker_view != "white" or self.config.attack_action != "any":
            raise ConfigurationError('tracker needs attacker_view="white" and attack_action="any"')
        if min(np.min(each) for each in (level, gain, cap_c)) <= 0 or np.min(noise) < 0:
            raise ConfigurationError(
                f"level = {level}, gain = {gain}, cap_c = {cap_c}, noise = {noise}: all have to be "
                "positive; the noise may be 0"
            )
        self.level, self.gain, self.cap_c = (np.reshape(each, (-1, 1)) for each in (level, gain, cap_c))  # (1 or B, 1)
        self.noise_c = np.reshape(noise, (-1, 1, 1)) * of_bodies(self.config.noise_std_c, self.config.num_sensors)
        self._sign = -1.0 if warmer else 1.0
        self._filters = FilterChoices(self.config)
        self._scale = build_model(self.config).filter_scale  # (F, S) 1/C
        self._all = int(self._filters.size.argmax())

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The biases (B, S), C, towards the attack's sign, and the noise (B, K, S), C, of the whole episode."""
        shape = (self.config.num_steps + 1, self.config.num_sensors)
        drawn = np.stack([generator.standard_normal(shape) for generator in generators])
        return np.zeros((len(generators), self.config.num_sensors)), self.noise_c * drawn

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S + 1)."""
        bias_c, noise_c = state
        rows, k = np.arange(len(seen)), elapsed_steps(seen, self.config)
        watched = self._filters.of_last_choice(seen, self._all)
        scale = self._scale[watched]
        r = self._sign * (noise_c[rows, k] * scale - seen["innovation"][rows, watched])  # above 0 the attack's way
        growing = (attack_age(seen, self.config) > 0)[:, np.newaxis] & (seen["compromised"] > 0.5)
        grown = np.minimum(np.maximum(bias_c + self.gain * (self.level - r) / scale, 0.0), self.cap_c)
        bias_c = np.where(growing, grown, bias_c)
        return bias_action(self.config, self._sign * bias_c - noise_c[rows, k + 1]), (bias_c, noise_c)
