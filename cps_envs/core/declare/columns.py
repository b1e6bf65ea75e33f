"""Actions as columns of a table: their names, units, and how an entry of an action becomes a value and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.types import Array, FloatArray


@dataclass(frozen=True)
class ActionColumn:
    """One entry of a role's action. Its value is 0 at `zero`, and `unit_value` further for each 1 of the entry.

    Where `below` is given, it is that much for each 1 below 0, as of a pedal that brakes harder than it drives.
    """

    name: str  # with its unit, as fields of a configuration have it, and a number where there are several
    unit: str
    meaning: str
    unit_value: float = 1.0
    zero: int = 0
    below: float | None = None

    def values(self, entries: FloatArray) -> FloatArray:
        """What entries (K,) of actions mean, in the unit."""
        moved = entries - self.zero
        found: FloatArray = moved * np.where(moved < 0, self._below, self.unit_value)
        return found

    def entries(self, values: FloatArray) -> FloatArray:
        """The entries (K,) that mean these values; they may lie outside the action space, or between whole numbers."""
        found: FloatArray = values / np.where(values < 0, self._below, self.unit_value) + self.zero
        return found

    @property
    def _below(self) -> float:
        return self.unit_value if self.below is None else self.below


def numbered(
    names: Sequence[str], unit: str, meaning: str, unit_value: float = 1.0, zero: int = 0, below: float | None = None
) -> tuple[ActionColumn, ...]:
    """Columns that differ in their names only."""
    return tuple(ActionColumn(name, unit, meaning, unit_value, zero, below) for name in names)


def counted(stem: str, count: int) -> list[str]:
    """`stem_1` to `stem_COUNT`."""
    return [f"{stem}_{place}" for place in range(1, count + 1)]


def raw_columns(space: spaces.Space[Any]) -> tuple[ActionColumn, ...]:
    """The entries of an action as they are, where a problem gives them no names."""
    size = int(np.prod(space.shape or (), dtype=np.int64))
    return numbered(counted("action", size), "-", "entry of the action")


def limits(space: spaces.Space[Any]) -> tuple[FloatArray, FloatArray]:
    """The least and the largest value (k,) of each entry of an action."""
    low: Array
    if isinstance(space, spaces.Discrete):
        low, high = np.array([space.start]), np.array([space.start + space.n - 1])
    elif isinstance(space, spaces.MultiDiscrete):
        low, high = space.start.ravel(), (space.start + space.nvec - 1).ravel()
    else:
        box: Any = space
        low, high = box.low.ravel(), box.high.ravel()
    return low.astype(np.float64), high.astype(np.float64)
