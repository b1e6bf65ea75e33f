"""An attack that lies boldly to a defender who does not check, and stealthily to one who does."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.brink import Brink
from cps_baselines.hvac.tracker import Tracker
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, Knowledge, State
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.sensors import sensor_sets

ROUNDING = 1.0 + 1e-4  # of what is observed


class Opportunist(AnalyticPolicy):
    """Suits its lie to the defender that it recognises.

    To one who follows Kalman filters it is `tracker`, to all others `brink`, until they are caught believing what MTD2
    would not: from then on it shows `reading_c`. Caught is a defender who feeds raw readings to the controller, or
    takes a set whose mean residual exceeds eps while it is not the smallest of all. MTD2 does neither, so whoever does
    will follow a bold lie.

    Raises:
        ConfigurationError: an attacker that does not see the defender's choice, or a reading outside the sensor range,
            besides what `brink` refuses.
    """

    def __init__(self, spec: RoleSpec, *, reading_c: float = 10.0, warmer: bool = False) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        if not self.config.attacker_sees_choice:
            raise ConfigurationError(
                "opportunist judges a defender by its choices, which attacker_sees_choice=false hides: set it to true, "
                "or choose listener"
            )
        self._careful = Brink(spec, warmer=warmer)
        self._tracker = Tracker(spec, warmer=warmer) if self.config.kalman_filters else None
        self._bold = absolute_action(self.config, np.array([[reading_c]]))
        self._sets = len(sensor_sets(self.config))

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Who has been caught (B,), mean residuals of a step ago (B, sets), C2, and states of `brink`, `tracker`.

        Without filters there is no `tracker`.
        """
        envs = len(generators)
        caught, before = np.zeros(envs, np.bool_), np.zeros((envs, self._sets))
        tracking = () if self._tracker is None else self._tracker.begin(generators, knowledge)
        return (caught, before, *self._careful.begin(generators, knowledge), *tracking)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S + 1)."""
        caught, before_c2, bias_c, *tracking = state
        choice, mean_c2 = seen["last_choice"], self._careful.in_c2(seen["mean_residual"])
        action, careful = self._careful.act(seen, (bias_c,))
        assert careful is not None
        if self._tracker is not None:
            tracked, following = self._tracker.act(seen, tuple(tracking))
            assert following is not None
            tracking = list(following)
            filtered: BoolArray = np.asarray((choice[:, self._sets + 2 :] > 0.5).any(axis=1))
            action = np.where(filtered[:, np.newaxis], tracked, action)
        caught = np.logical_or(caught, self._gives_itself_away(choice, before_c2))
        return np.where(caught[:, np.newaxis], self._bold, action), (caught, mean_c2, *careful, *tracking)

    def _gives_itself_away(self, choice: FloatArray, before_c2: FloatArray) -> BoolArray:
        """Whether the last choice, one-hot (B, choices), is one that MTD2 would not have made of what it saw."""
        limit = np.maximum(self.config.threshold_c2, before_c2.min(axis=1, keepdims=True))
        failed = before_c2 > ROUNDING * limit
        found: BoolArray = (choice[:, 0] > 0.5) | ((choice[:, 1 : self._sets + 1] > 0.5) & failed).any(axis=1)
        return found
