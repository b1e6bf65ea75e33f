"""Quadratic programs of the mitigation, solved alone: by the shipped kernels, and by a library as a check of them."""

from __future__ import annotations

import numpy as np
import osqp
from scipy import sparse

from cps_baselines.disbanding.joint_program import (
    CAPS,
    PENALTIES,
    JointDesign,
    JointScratch,
    JointSettings,
    solve_joint,
)
from cps_baselines.disbanding.quadratic_program import (
    SWEEPS,
    TOLERANCE,
    QuadraticProgram,
    climb_dual,
    constrain,
    slacks,
    unconstrained,
)
from cps_envs.core.compute.kernels import kernel, lend
from cps_envs.core.types import FloatArray

SLACK_ROOT = 300.0**0.5  # of OSQP's penalty for gaps that give way; chosen by how fast it ends
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


@kernel
def joint_by_kernel(
    design: JointDesign,
    count: int,
    commands: FloatArray,
    multipliers: FloatArray,
    iterations: int,
    tolerance: float,
    given: JointScratch,
) -> float:
    """`solve_joint`, compiled."""
    return solve_joint(lend(design), count, commands, multipliers, iterations, tolerance, lend(given))


class JointByLibrary:
    """OSQP on the joint programs of `count` vehicles for one lag, warm-started by what it solved last.

    Its penalties for the rows are those of the shipped splitting. Gaps may give way at their price, by variables of
    their own.
    """

    def __init__(
        self, design: JointDesign, settings: JointSettings, count: int, accuracy: float, iterations: int = 50_000
    ) -> None:
        hessian, rows = joint_matrices(design, settings, count)
        self.shape, size = (count, settings.horizon), len(hessian)
        self.roots = np.sqrt(PENALTIES)[:, None]
        commands, speeds, gaps = (root * row for root, row in zip(self.roots, rows, strict=True))
        room = sparse.identity(size)
        upper = sparse.csc_matrix(np.triu(hessian))  # without its zeros, which `block_diag` would keep
        cost = sparse.block_diag([upper, sparse.csc_matrix((size, size))], format="csc")
        limited = [[commands, None], [speeds, None], [gaps, self.roots[2, 0] * room], [None, SLACK_ROOT * room]]
        ends = np.full(4 * size, 1.0)
        self.solver = osqp.OSQP()
        plain = {"eps_rel": 0.0, "rho": 1.0, "adaptive_rho": False, "scaling": 0, "check_termination": 5}
        stacked = sparse.bmat(limited, format="csc")
        plain |= {"eps_abs": accuracy, "max_iter": iterations, "verbose": False}
        self.solver.setup(cost, np.zeros(2 * size), stacked, -ends, ends, **plain)

    def solve(self, given: JointScratch) -> FloatArray:
        """The commands (count, H); not the optimum where the iterations do not suffice."""
        size = self.shape[0] * self.shape[1]
        low, high = (self.roots * each[:, : self.shape[0]].reshape(3, size) for each in (given.low, given.high))
        self.solver.update(
            q=np.concatenate([given.linear[: self.shape[0]].ravel(), np.full(size, CAPS[2])]),
            l=np.concatenate([low.ravel(), np.zeros(size)]),
            u=np.concatenate([high.ravel(), np.full(size, np.inf)]),
        )
        return np.reshape(self.solver.solve(raise_error=False).x[:size], self.shape)


def joint_matrices(design: JointDesign, settings: JointSettings, count: int) -> tuple[FloatArray, list[FloatArray]]:
    """H and the rows (commands, speeds, gaps) of the joint program of `count` vehicles, stacked."""
    own, chain = np.eye(count), np.eye(count, k=-1) - np.eye(count)  # gap i = x(i - 1) - x(i)
    speeds, closings, gaps = np.kron(own, design.speed), np.kron(chain, design.speed), np.kron(chain, design.place)
    hessian = settings.command_weight * np.eye(len(speeds)) + settings.speed_weight * speeds.T @ speeds
    hessian += settings.gap_weight * gaps.T @ gaps + settings.closing_weight * closings.T @ closings
    return hessian, [np.eye(len(speeds)), speeds, gaps]
