"""How the kernels of this problem are compiled."""

from __future__ import annotations

from typing import Any, TypeAlias

from numba import njit

# Inlined: the calls of a step, some thirty of a few operations each, would cost as much as the step itself.
kernel = njit(cache=True, nogil=True, error_model="numpy", forceinline=True)

# An element of a structured array, with its fields as attributes. Kernels hand records on, not arrays: a record is a
# bare pointer, whereas each array handed on is counted, which costs more than a step of the physics.
Record: TypeAlias = Any


@kernel
def clip(value: float, low: float, high: float) -> float:
    """The value limited to [low, high]."""
    return min(max(value, low), high)
