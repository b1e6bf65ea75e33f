"""Defenders that believe the same sensors at every step: a fixed set, or none at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State
from cps_envs.hvac.sensors import sensor_sets


class Steady(AnalyticPolicy):
    """Base: one choice, once the window is full; until then the recursive least squares of all sensors."""

    def __init__(self, spec: RoleSpec, choice: int) -> None:
        super().__init__(spec)
        self.choice = choice
        self._start = len(sensor_sets(spec.config)) + 1

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Choices (B,)."""
        return np.where(seen["ready"] > 0.5, self.choice, self._start), state


class FixedSet(Steady):
    """Always uses the same sensors, as in Fig. 4.5: `fixed?sensors=[2]`.

    Without `sensors`, the last of the largest sets: 1, 2 and 3 of four.

    Raises:
        ConfigurationError: these sensors are none of the configuration's sets.
    """

    def __init__(self, spec: RoleSpec, sensors: Sequence[int] | None = None) -> None:
        sets = sensor_sets(spec.config)
        wanted = max(reversed(sets), key=len) if sensors is None else tuple(sorted(sensors))
        if wanted not in sets:
            raise ConfigurationError(
                f"sensors = {list(wanted)} is no set that the observer may use; choose one of "
                f"{', '.join(str(list(each)) for each in sets[:4])}, ..., or name it in the field sensor_sets"
            )
        super().__init__(spec, sets.index(wanted) + 1)
        self.sensors = wanted


class ModelOnly(Steady):
    """Ignores all sensors once the window is full. The controller gets the model's prediction.

    With an exact model no attack can reach it, and none matters; a defender counts only if it beats this one too.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec, len(sensor_sets(spec.config)) + 1)
