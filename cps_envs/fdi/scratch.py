"""What the kernels work with besides the episodes themselves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.kernels import borrowed, inlined
from cps_envs.core.types import FloatArray, IntArray


class Scratch(NamedTuple):
    """What a turn works with besides an episode's memory; one episode uses it after the other."""

    trust: FloatArray  # (2n,) of the defender in the present step, 1 or 0
    correction: FloatArray  # (n,) of the defender in the present step, m/s2
    offset: FloatArray  # (2n,) of what is used from the true values
    state: FloatArray  # (2n,)
    row: FloatArray  # (S,) coefficients of the levels
    level: IntArray  # (S,) injected
    interval: IntArray  # (S, 2) legal levels while they are chosen


@inlined
def new_scratch(n: int, slots: int) -> Scratch:
    """Of a platoon whose defender trusts every sensor and corrects nothing."""
    return Scratch(
        np.ones(2 * n),
        np.zeros(n),
        np.empty(2 * n),
        np.empty(2 * n),
        np.empty(slots),
        np.zeros(slots, np.int64),
        np.empty((slots, 2), np.int64),
    )


@inlined
def lent(s: Scratch) -> Scratch:
    """The scratch without its owners."""
    return Scratch(
        borrowed(s.trust),
        borrowed(s.correction),
        borrowed(s.offset),
        borrowed(s.state),
        borrowed(s.row),
        borrowed(s.level),
        borrowed(s.interval),
    )
