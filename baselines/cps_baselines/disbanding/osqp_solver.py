"""Quadratic programs by the OSQP library: an independent check of the built-in solver, and slower."""

from __future__ import annotations

import numpy as np
import osqp
from scipy import sparse

from cps_baselines.disbanding.quadratic_program import QuadraticProgram, Vector


class OsqpSolver:
    """Operator splitting by the OSQP library, set up once per constant part; slower, an independent check."""

    def __init__(self, qp: QuadraticProgram, *, tolerance: float = 1e-8, max_iterations: int = 4000) -> None:
        self.osqp = osqp.OSQP()
        unlimited = np.full(len(qp.rows), np.inf)
        self.osqp.setup(
            P=sparse.csc_matrix(np.triu(qp.hessian)),
            q=np.zeros(len(qp.hessian)),
            A=sparse.csc_matrix(qp.rows),
            l=-unlimited,
            u=unlimited,
            eps_abs=tolerance,
            eps_rel=tolerance,
            max_iter=max_iterations,
            verbose=False,
        )

    def solve(self, linear: Vector, limits: Vector) -> Vector:
        """See `Solver.solve`."""
        self.osqp.update(q=linear, u=limits)
        return np.asarray(self.osqp.solve(raise_error=False).x, np.float64)
