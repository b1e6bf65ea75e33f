"""Small vectors and matrices in loops, in a fixed order of operations, so that every episode rounds alike.

Loops compile to a fraction of what numba makes of array expressions, which bring checks of shapes and their messages.
"""

from __future__ import annotations

import numpy as np

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray


@inlined
def copy(values: FloatArray, out: FloatArray) -> None:
    """Write `values` (n,) into `out` (n,)."""
    for i in range(len(values)):
        out[i] = values[i]


@inlined
def product(left: FloatArray, right: FloatArray) -> FloatArray:
    """A matrix product."""
    out = np.zeros((left.shape[0], right.shape[1]))
    for i in range(left.shape[0]):
        for m in range(left.shape[1]):
            for j in range(right.shape[1]):
                out[i, j] += left[i, m] * right[m, j]
    return out


@inlined
def drift(A: FloatArray, B: FloatArray, G: FloatArray, x: FloatArray, u: FloatArray, w: FloatArray) -> FloatArray:
    """A x + B u + G w, (n,), with diagonal B and G."""
    reached = np.empty(len(x))
    for i in range(len(x)):
        total = B[i] * u[i] + G[i] * w[i]
        for j in range(len(x)):
            total += A[i, j] * x[j]
        reached[i] = total
    return reached
