"""An attack that lies boldly to a defender who does not check, and stealthily to one who does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.hvac.brink import Brink
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.sensors import sensor_sets

ROUNDING = 1.0 + 1e-4  # of what is observed


class Opportunist(Brink):
    """`brink` until the defender is caught believing what MTD2 would not; from then on a reading of `reading_c`.

    Caught is a defender who feeds raw readings to the controller, or takes a set whose mean residual exceeds eps while
    it is not the smallest of all. MTD2 does neither, so whoever does will follow a bold lie.

    Raises:
        ConfigurationError: a reading outside the sensor range, besides what `brink` refuses.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        reading_c: float = 10.0,
        margin_c2: float = 0.01,
        gain: float = 1.0,
        most: float = 2.0,
        warmer: bool = False,
    ) -> None:
        super().__init__(spec, margin_c2=margin_c2, gain=gain, most=most, warmer=warmer)
        self._bold = absolute_action(self.config, np.array([[reading_c]]))
        self._sets = len(sensor_sets(self.config))

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Sizes of the biases (B, S), C, mean residuals of a step ago (B, sets), C2, and who has been caught (B,)."""
        envs = len(generators)
        return np.zeros((envs, self.config.num_sensors)), np.zeros((envs, self._sets)), np.zeros(envs, np.bool_)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S + 1)."""
        assert state is not None
        bias_c, before_c2, caught = state
        careful, grown = super().act(seen, (bias_c,))
        assert grown is not None
        caught = caught | self._gives_itself_away(seen["last_choice"], before_c2)
        state = (grown[0], self._c2(seen["mean_residual"]), caught)
        return np.where(caught[:, np.newaxis], self._bold, careful), state

    def _gives_itself_away(self, choice: FloatArray, before_c2: FloatArray) -> BoolArray:
        """Whether the last choice, one-hot (B, choices), is one that MTD2 would not have made of what it saw."""
        limit = np.maximum(self.config.threshold_c2, before_c2.min(axis=1, keepdims=True))
        failed = before_c2 > ROUNDING * limit
        found: BoolArray = (choice[:, 0] > 0.5) | ((choice[:, 1 : self._sets + 1] > 0.5) & failed).any(axis=1)
        return found
