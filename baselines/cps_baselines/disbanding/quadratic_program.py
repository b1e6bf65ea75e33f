"""Quadratic programs with a constant matrix by dual iteration: min 1/2 U' H U + f' U subject to G U <= w."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import copy, fill, inlined
from cps_envs.core.types import FloatArray, IntArray

Vector = FloatArray
SWEEPS = 60  # cap of the dual iteration in the controller
TOLERANCE = 1e-6  # it ends when no multiplier changes by more than this in a sweep


class QuadraticProgram(NamedTuple):
    """The constant part for n variables and m rows; no row of G may be zero."""

    hessian: Vector  # (n, n) H, positive definite
    rows: Vector  # (m, n) G
    inverse: Vector  # (n, n) H^-1
    row_response: Vector  # (m, n) G H^-1: minus the change of U per unit of each multiplier
    dual_hessian: Vector  # (m, m) G H^-1 G'
    columns: Vector  # (n, m) G', along which loops over the rows vectorise
    inverse_columns: Vector  # (n, n) the same of H^-1


def quadratic_program(hessian: Vector, rows: Vector) -> QuadraticProgram:
    """Factor the constant part once."""
    inverse = np.linalg.inv(hessian)
    response = rows @ inverse
    made = (hessian, rows, inverse, response, response @ rows.T, rows.T, inverse.T)
    return QuadraticProgram(*map(np.ascontiguousarray, made))


@inlined
def unconstrained(qp: QuadraticProgram, linear: Vector, out: Vector) -> None:
    """Fill `out` (n,) with the optimum without the rows, -H^-1 f."""
    fill(out, 0.0)
    for j in range(out.size):
        for i in range(out.size):
            out[i] -= qp.inverse_columns[j, i] * linear[j]


@inlined
def slacks(qp: QuadraticProgram, solution: Vector, limits: Vector, out: Vector) -> float:
    """Fill `out` (m,) with w - G U and return the smallest one: U is feasible when it is not negative."""
    copy(limits, out)
    for j in range(solution.size):
        for i in range(out.size):
            out[i] -= qp.columns[j, i] * solution[j]
    smallest = np.inf
    for i in range(out.size):
        smallest = min(smallest, out[i])
    return smallest


@inlined
def climb_dual(
    qp: QuadraticProgram, slack: Vector, multipliers: Vector, positive: IntArray, sweeps: int, tolerance: float
) -> int:
    """Hildreth's iteration: improve the `multipliers` (m,) >= 0 in place, one by one; returns the sweeps used.

    `slack` (m,) belongs to the unconstrained optimum. The cap on the sweeps also ends programs without a feasible
    point, whose multipliers would grow for ever; every iterate is a valid start for more sweeps. `positive` (m,) is
    room for the rows whose multiplier is not zero: they are few, and the other terms of a gradient vanish.
    """
    count = list_positive(multipliers, positive)
    for sweep in range(sweeps):
        change = 0.0
        for i in range(slack.size):
            gradient, before = slack[i], multipliers[i]
            for k in range(count):
                gradient += qp.dual_hessian[i, positive[k]] * multipliers[positive[k]]
            if before > 0.0 or gradient < 0.0:
                better = max(0.0, before - gradient / qp.dual_hessian[i, i])
                change = max(change, abs(better - before))
                multipliers[i] = better
                if (better > 0.0) != (before > 0.0):
                    count = list_positive(multipliers, positive)
        if change < tolerance:
            return sweep + 1
    return sweeps


@inlined
def list_positive(multipliers: Vector, positive: IntArray) -> int:
    """Write the rows with a positive multiplier into `positive` (m,), in their order; returns how many there are."""
    count = 0
    for i in range(multipliers.size):
        positive[count] = i
        count += multipliers[i] > 0.0
    return count


@inlined
def constrain(qp: QuadraticProgram, multipliers: Vector, solution: Vector) -> None:
    """Move the unconstrained optimum `solution` (n,) in place to the point that belongs to the multipliers."""
    for i in range(qp.rows.shape[0]):
        if multipliers[i] > 0.0:
            for j in range(solution.shape[0]):
                solution[j] -= multipliers[i] * qp.row_response[i, j]
