"""Quantities of bodies that differ, such as vehicles, where draws are possible.

A value is a number, or a pair (low, high) from which every reset draws. A tuple with a value for each body names them
one by one, and each draws its own. Two numbers are always a pair: two bodies are written as ((a, a), (b, b)).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray


def names_each(value: Any) -> bool:
    """Whether a value names the bodies one by one."""
    return isinstance(value, tuple) and (len(value) != 2 or any(isinstance(part, tuple) for part in value))


def spans(value: Any) -> FloatArray:
    """The lowest and the highest values (2, m) that each of m bodies can have; m is 1 where all share one."""
    parts = value if names_each(value) else (value,)
    return np.array([part if isinstance(part, tuple) else (part, part) for part in parts], np.float64).T.copy()
