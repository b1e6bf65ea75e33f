"""Single fields of an observation in units: a fraction of the cost of decoding all of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cps_envs.core.fields import Fields
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import Array, FloatArray, IntArray

Reader = Callable[[Array], FloatArray]


def read_field(fields: Fields, name: str) -> Reader:
    """A function that takes observations (B, size) to the values (B, entries) of one field, in its unit."""
    place = fields.slices[name]
    (field,) = (field for field in fields if field.name == name)
    half, middle = (field.high - field.low) / 2, (field.high + field.low) / 2
    return lambda observation: observation[:, place].astype(np.float64) * half + middle


class Clock:
    """Whole steps (B,) that a field in hours stands for."""

    def __init__(self, spec: RoleSpec, name: str = "elapsed_h") -> None:
        self._hours = read_field(spec.fields, name)
        self._steps_per_h = 3600.0 / spec.config.step_s

    def __call__(self, observation: Array) -> IntArray:
        """The steps that observations (B, size) show."""
        return np.rint(self._hours(observation)[:, 0] * self._steps_per_h).astype(np.int64)
