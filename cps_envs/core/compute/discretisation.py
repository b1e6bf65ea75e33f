"""From continuous to sampled linear systems, without scipy, which the core does not need otherwise."""

from __future__ import annotations

import math

import numpy as np

from cps_envs.core.types import FloatArray

TERMS = 18  # of the exponential series; its remainder is below rounding for norms up to 1/2


def matrix_exponential(matrix: FloatArray) -> FloatArray:
    """The exponential of a square matrix (k, k), by scaling and squaring the power series."""
    norm = float(np.abs(matrix).sum(axis=1).max(initial=0.0))
    halvings = max(0, math.ceil(math.log2(2 * norm))) if norm > 0 else 0
    scaled = matrix / 2.0**halvings
    result = np.eye(len(matrix))
    for order in range(TERMS, 0, -1):  # Horner's scheme
        result = np.eye(len(matrix)) + scaled @ result / order
    for _ in range(halvings):
        result = result @ result
    return result


def zero_order_hold(a: FloatArray, b: FloatArray, dt_s: float) -> tuple[FloatArray, FloatArray]:
    """(A, B) of x(k+1) = A x(k) + B u(k) for x' = a x + b u with u held for dt_s; a (k, k), b (k, j)."""
    states, inputs = b.shape
    joint = np.zeros((states + inputs, states + inputs))
    joint[:states, :states], joint[:states, states:] = a, b
    step = matrix_exponential(dt_s * joint)
    return step[:states, :states], step[:states, states:]
