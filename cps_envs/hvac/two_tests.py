"""The attack as a learner plays it against two tests: what a filter expects, and what a sensor's own set leaves."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, State
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.columns import squeeze, squeezed
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.expected import LEVELS, MAX_BIAS_C, Together, expected_fields
from cps_envs.hvac.sensors import sensor_sets

FILLS = (-2.0, -0.5, 0.5, 2.0)  # most of the own set's residual, in eps, with the sign of the lie; all chosen
MARGIN_C2 = 0.01  # that the mean residual stays below eps
MOST_RESIDUAL = 8.0  # ln(1 + J/eps), as the attacker sees them


def two_tests_fields(config: HvacConfig) -> Fields:
    """What `expected_fields` has, and how the set of the sensor alone fares; it is 0 until the window is full."""
    return Fields(
        *expected_fields(config),
        Field("own_residual", "ln(1 + J/eps)", 0, MOST_RESIDUAL, (), "of the set of this sensor alone, now"),
        Field("own_mean", "ln(1 + J/eps)", 0, 1.5, (), "its mean since the window is full, which MTD2 compares with 1"),
        squeezed("own_room", "C", MAX_BIAS_C, "by which the lie may grow at the next step and still pass, at 2 eps"),
        Field("noise_free", "-", 0, 1, (), "whether the sensor shows no noise now"),
    )


class TwoTests(Together):
    """One agent that holds the lies of all compromised sensors just below one of two tests, or says which level.

    Actions 0 to 8 are those of `together`: a level of the filter's innovation, on top of the own noisy reading. The
    others, 9 to 12, forge the true temperature plus a bias, without noise, and hold the residual J of the set of each
    sensor alone. Its mean Jm is to stay below eps, so at the next step the error may be e with e^2 = (n + 1) (eps -
    margin) - n Jm, at most 2 or .5 eps: |b|(k + 1) = |b|(k) + e - sqrt(J), towards colder readings (9 and 10) or
    warmer ones (11 and 12). With 9 all day it plays the controller `brink`. A bias stays when the test changes.

    Raises:
        ConfigurationError: what `together` refuses, an attacker that cannot forge without noise, or a sensor that is
            no set of its own.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config: HvacConfig = spec.config
        sets = sensor_sets(config)
        alone = [(sensor,) for sensor in range(1, config.num_sensors + 1)]
        if config.attack_action != "any" or not set(alone) <= set(sets):
            raise ConfigurationError(
                'the adapter "two_tests" forges readings without noise and holds the residual of each sensor alone: it '
                'needs attack_action="any" and a set of each sensor in sensor_sets. Or take adapter="together".'
            )
        self.fields = two_tests_fields(config)
        self.action_space = spaces.Discrete(len(LEVELS) + len(FILLS))
        self._own_set = np.array([sets.index(each) for each in alone])  # (S,)
        self._fills = np.array((*(0.0 for _ in LEVELS), *FILLS))  # by action; 0: a level
        self._neutral = int(self.neutral_action)

    def begin(self, num_envs: int) -> State:
        """The biases (B, S), C, the levels (B, S) that are held, and which readings (B, S) have no noise."""
        shape = (num_envs, self.sensors)
        return np.zeros(shape), np.zeros(shape), np.zeros(shape)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The role's action from the index (B, 1) of a level or of how far the other test is filled."""
        bias_c, _, noise_free = state
        fill, forges = self._fills[actions], self.forges(seen)  # (B, 1), (B, S)
        exact = fill != 0.0
        level = self._levels[np.where(exact, self._neutral, actions)]
        expected = self._grown(seen, bias_c, level, 1.0 - noise_free)
        sign = np.sign(fill)
        size = np.maximum(sign * bias_c, 0.0) + self._room(seen, np.abs(fill))
        filled = sign * np.minimum(np.maximum(size, 0.0), MAX_BIAS_C)
        bias_c = np.where(forges & self._begun(seen), np.where(exact, filled, expected), 0.0)
        based = [bias_action(self._config, -bias_c, keep_noise=keep) for keep in (False, True)]
        after = (bias_c, np.where(forges & ~exact, level, 0.0), np.where(forges & exact, 1.0, 0.0))
        return np.where(exact, *based), after

    def _room(self, seen: Seen, most: FloatArray | float) -> FloatArray:
        """The growth (B, S), C, of each lie that its own set still passes; 0 until the window is full."""
        eps, config = self._config.threshold_c2, self._config
        steps = np.rint(seen["elapsed_h"] / self._step_h)[:, np.newaxis] - config.window_steps + 1.0
        mean = eps * np.expm1(seen["mean_residual"][:, self._own_set])
        left = (np.maximum(steps, 0.0) + 1.0) * (eps - MARGIN_C2) - np.maximum(steps, 0.0) * mean
        allowed = np.sqrt(np.minimum(np.maximum(left, 0.0), np.maximum(most, 1e-9) * eps))
        error = np.sqrt(eps * np.expm1(seen["residual"][:, self._own_set]))
        room: FloatArray = np.where(steps > 0, allowed - error, 0.0)
        return room

    def columns(self, seen: Seen, state: State) -> dict[str, FloatArray]:
        """See `two_tests_fields`."""
        own = {
            "own_residual": seen["residual"][:, self._own_set],
            "own_mean": seen["mean_residual"][:, self._own_set],
            "own_room": squeeze(self._room(seen, FILLS[-1]), "C"),
            "noise_free": state[2],
        }
        return super().columns(seen, state) | own
