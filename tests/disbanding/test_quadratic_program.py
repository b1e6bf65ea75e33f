from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from cps_baselines.disbanding.mpc import PAPER_MATCHING, design_mpc
from cps_baselines.disbanding.osqp_solver import OsqpSolver
from cps_baselines.disbanding.quadratic_program import HildrethSolver, QuadraticProgram, quadratic_program

EXACT: dict[str, Any] = {"sweeps": 100_000, "tolerance": 1e-12}


def random_program(rng: np.random.Generator) -> tuple[QuadraticProgram, np.ndarray, np.ndarray]:
    """A program with a feasible point, whose unconstrained optimum violates some rows."""
    size, rows = 5, 8
    root = rng.normal(size=(size, size))
    matrix = rng.normal(size=(rows, size))
    limits = matrix @ rng.normal(size=size) + rng.uniform(0.0, 0.5, rows)
    return quadratic_program(root @ root.T + np.eye(size), matrix), 3.0 * rng.normal(size=size), limits


@pytest.mark.parametrize("seed", range(12))
def test_solvers_agree(seed: int) -> None:
    qp, linear, limits = random_program(np.random.default_rng(seed))
    hildreth, osqp = HildrethSolver(qp, **EXACT), OsqpSolver(qp)
    ours = hildreth.solve(linear, limits)
    scipy = minimize(
        lambda u: 0.5 * u @ qp.hessian @ u + linear @ u,
        np.zeros(len(linear)),
        jac=lambda u: qp.hessian @ u + linear,
        constraints=LinearConstraint(qp.rows, ub=limits),
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 200},
    )
    np.testing.assert_allclose(osqp.solve(linear, limits), scipy.x, atol=1e-5)
    np.testing.assert_allclose(ours, scipy.x, atol=1e-5)


@pytest.mark.parametrize("seed", range(12))
def test_optimality_conditions(seed: int) -> None:
    qp, linear, limits = random_program(np.random.default_rng(100 + seed))
    solver = HildrethSolver(qp, **EXACT)
    solution = solver.solve(linear, limits)
    multipliers, slack = solver.multipliers, limits - qp.rows @ solution
    assert (multipliers >= 0.0).all()
    np.testing.assert_allclose(qp.hessian @ solution + linear + qp.rows.T @ multipliers, 0.0, atol=1e-9)
    assert slack.min() > -1e-7
    np.testing.assert_allclose(multipliers * slack, 0.0, atol=1e-6)


def test_a_warm_start_continues() -> None:
    qp, linear, limits = random_program(np.random.default_rng(4))
    solver, cold = HildrethSolver(qp, warm_start=True), HildrethSolver(qp)
    once = solver.solve(linear, limits)
    again = solver.solve(linear, limits)
    np.testing.assert_allclose(once, cold.solve(linear, limits), atol=1e-9)
    exact = OsqpSolver(qp).solve(linear, limits)
    assert np.abs(again - exact).max() <= np.abs(once - exact).max() + 1e-9


def test_the_cap_bounds_the_work() -> None:
    qp, linear, limits = random_program(np.random.default_rng(104))
    capped, exact = HildrethSolver(qp).solve(linear, limits), HildrethSolver(qp, **EXACT).solve(linear, limits)
    assert 1e-6 < np.abs(capped - exact).max() < 0.2


def test_infeasible_programs_end() -> None:
    qp = design_mpc(PAPER_MATCHING, 0.3).qp
    limits = np.full(len(qp.rows), -100.0)
    assert np.isfinite(HildrethSolver(qp).solve(np.ones(5), limits)).all()
