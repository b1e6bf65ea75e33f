"""A scale for entries that are small in normal traffic and large in an attack: both stay visible."""

from __future__ import annotations

import math

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.declare.fields import Field

MOST = 5.3  # asinh(100): 10 m, 5 m/s, 20 m/s2, 5 deviations are the most that is shown; chosen
GAP_M = 0.1  # units, chosen: a third to a half of what entries vary by while nobody attacks
SPEED_MPS = 0.05
COMMAND_MPS2 = 0.2
FILTER_DEVIATIONS = 0.05


def bent_field(name: str, unit: float, written: str, shape: tuple[int, ...], description: str) -> Field:
    """A field of entries that `bent` makes; `written` is the unit in words, such as "m"."""
    return Field(name, "-", -MOST, MOST, shape, f"asinh(x / {unit:g} {written}) of {description}")


@inlined
def bent(value: float, unit: float) -> float:
    """Linear below the unit, logarithmic above."""
    return math.asinh(value / unit)
