"""Time as an observation shows it, read alone: a fraction of the cost of decoding everything."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import Array, IntArray


class Clock:
    """Whole steps that a field in hours stands for."""

    def __init__(self, spec: RoleSpec, name: str) -> None:
        (field,) = (field for field in spec.fields if field.name == name)
        steps_per_h = 3600.0 / spec.config.step_s
        self._place = spec.fields.slices[name].start
        self._half, self._middle = (steps_per_h * (field.high + sign * field.low) / 2 for sign in (-1, 1))

    def __call__(self, observation: Array) -> IntArray:
        """The steps (B,) that observations (B, size) show."""
        shown = observation[:, self._place].astype(np.float64)
        steps: IntArray = np.rint(shown * self._half + self._middle).astype(np.int64)
        return steps
