"""Quadratic programs of the mitigation, solved alone: by the shipped kernels, and by a library as a check of them."""

from __future__ import annotations

import numpy as np
import osqp
from scipy import sparse

from cps_baselines.disbanding.quadratic_program import (
    SWEEPS,
    TOLERANCE,
    QuadraticProgram,
    climb_dual,
    constrain,
    slacks,
    unconstrained,
)
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.types import FloatArray

EXACT = 100_000, 1e-12  # sweeps and tolerance of a dual iteration that ends at the optimum


def hildreth(
    qp: QuadraticProgram,
    linear: FloatArray,
    limits: FloatArray,
    cap: tuple[int, float] = (SWEEPS, TOLERANCE),
    multipliers: FloatArray | None = None,
) -> FloatArray:
    """The optimum (n,) by the dual iteration, begun and ended with the `multipliers` (m,), or with zeros."""
    solution = np.empty(len(linear))
    start = np.zeros(len(limits)) if multipliers is None else multipliers
    _solve(qp, linear, limits, *cap, start, solution)
    return solution


@kernel
def _solve(
    qp: QuadraticProgram,
    linear: FloatArray,
    limits: FloatArray,
    sweeps: int,
    tolerance: float,
    multipliers: FloatArray,
    solution: FloatArray,
) -> None:
    slack = np.empty(limits.size)
    unconstrained(qp, linear, solution)
    if slacks(qp, solution, limits, slack) < 0.0:
        climb_dual(qp, slack, multipliers, np.empty(slack.size, np.int64), sweeps, tolerance)
        constrain(qp, multipliers, solution)


def by_library(qp: QuadraticProgram, linear: FloatArray, limits: FloatArray) -> FloatArray:
    """The optimum (n,) by operator splitting."""
    solver, unlimited = osqp.OSQP(), np.full(len(limits), np.inf)
    hessian, rows = sparse.csc_matrix(np.triu(qp.hessian)), sparse.csc_matrix(qp.rows)
    solver.setup(hessian, linear, rows, -unlimited, limits, eps_abs=1e-8, eps_rel=1e-8, max_iter=4000, verbose=False)
    return np.asarray(solver.solve(raise_error=False).x, np.float64)
