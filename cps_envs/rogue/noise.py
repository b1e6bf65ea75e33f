"""Sensor noise as a function of episode, step and entry, so that looking twice shows the same."""

from __future__ import annotations

from math import cos, log, sqrt

import numpy as np

from cps_envs.core.compute.kernels import inlined

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
FIRST = np.uint64(0xBF58476D1CE4E5B9)
SECOND = np.uint64(0x94D049BB133111EB)
UNIT = 1.0 / (1 << 53)
FULL_TURN = 6.283185307179586


@inlined
def scrambled(key: np.uint64) -> np.uint64:
    """The finaliser of splitmix64."""
    key = (key ^ (key >> np.uint64(30))) * FIRST
    key = (key ^ (key >> np.uint64(27))) * SECOND
    return key ^ (key >> np.uint64(31))


@inlined
def uniform(key: np.uint64) -> float:
    """A number in (0, 1)."""
    return (np.float64(scrambled(key) >> np.uint64(11)) + 0.5) * UNIT


@inlined
def noise(deviation: float, seed: int, step: int, entry: int) -> float:
    """A normal draw of this deviation (Box and Muller); 0 where the deviation is 0."""
    if deviation == 0.0:
        return 0.0
    key = scrambled(np.uint64(np.int64(seed)) + GOLDEN * np.uint64(step)) + GOLDEN * np.uint64(2 * entry + 1)
    radius = sqrt(-2.0 * log(uniform(key)))
    return deviation * radius * cos(FULL_TURN * uniform(key + GOLDEN))
