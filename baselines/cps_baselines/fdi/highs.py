"""Linear and mixed-integer programs by HiGHS, through its own Python interface."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from cps_baselines.fdi.lifted import Rows
from cps_envs.core.errors import require
from cps_envs.core.types import BoolArray, FloatArray

FEASIBLE = 1e-8  # violation of a row, or of a whole number, that the solver may leave
THREAD_ENDS_S = 0.5  # a process that ends sooner after a cancelled solve aborts: the solver's thread still cleans up
OPTIMAL, INFEASIBLE, TIME_LIMIT, NODE_LIMIT = "optimal", "infeasible", "time limit", "node limit"
MOST_NODES = 2**31 - 1


@dataclass(frozen=True)
class Program:
    """Minimise cost'y subject to rows and column bounds; `integer` marks whole columns, none where it is None."""

    cost: FloatArray  # (columns,)
    rows: Rows
    lower: FloatArray  # (columns,)
    upper: FloatArray  # (columns,)
    integer: BoolArray | None = None  # (columns,)


@dataclass(frozen=True)
class Limits:
    """When to stop: time, nodes, and the gaps between the incumbent and the dual bound."""

    time_s: float = np.inf
    nodes: int = MOST_NODES  # unlike time, the same on every machine
    relative_gap: float = 0.0
    absolute_gap: float = 1e-6


class Solution(NamedTuple):
    """What the solver found."""

    status: str  # "optimal" within the gaps, "infeasible", "time limit" or "node limit"
    columns: FloatArray | None  # None where no feasible point is known
    objective: float  # of the point; inf without one
    bound: float  # no feasible point has a lower objective; -inf where the solver has none


UNSOLVED = Solution(TIME_LIMIT, None, np.inf, -np.inf)  # after no time at all


def highspy() -> ModuleType:
    """The solver's package.

    Raises:
        MissingExtraError: not installed.
    """
    return require("highspy", extra="baselines", purpose="the reachability oracle")


def solve(program: Program, limits: Limits | None = None, start: FloatArray | None = None) -> Solution:
    """Solve a program from rest; `start` is a feasible point (columns,) to begin with."""
    solver = load(program)
    limits = limits or Limits()
    for option, value in (
        ("time_limit", limits.time_s),
        ("mip_max_nodes", limits.nodes),
        ("mip_rel_gap", limits.relative_gap),
        ("mip_abs_gap", limits.absolute_gap),
    ):
        solver.setOptionValue(option, value)
    if start is not None:
        point = highspy().HighsSolution()
        point.col_value = start.tolist()
        solver.setSolution(point)
    return run(solver, mixed=program.integer is not None)


def load(program: Program) -> Any:
    """A silent `highspy.Highs` with one thread that holds the program with e(0) = 0."""
    package = highspy()
    solver, model, matrix = package.Highs(), package.HighsLp(), program.rows.matrix
    solver.setOptionValue("output_flag", False)
    solver.setOptionValue("threads", 1)
    solver.setOptionValue("primal_feasibility_tolerance", FEASIBLE)
    solver.setOptionValue("mip_feasibility_tolerance", FEASIBLE)
    model.num_row_, model.num_col_ = matrix.shape
    model.col_cost_, model.col_lower_, model.col_upper_ = program.cost, program.lower, program.upper
    model.row_lower_, model.row_upper_ = program.rows.lower, program.rows.upper
    model.a_matrix_.format_ = package.MatrixFormat.kRowwise
    model.a_matrix_.start_, model.a_matrix_.index_, model.a_matrix_.value_ = matrix.indptr, matrix.indices, matrix.data
    if program.integer is not None:
        kinds = package.HighsVarType
        model.integrality_ = [kinds.kInteger if whole else kinds.kContinuous for whole in program.integer]
    solver.passModel(model)
    return solver


def run(solver: Any, *, mixed: bool = False) -> Solution:
    """Solve what a solver holds; `mixed` says that some columns are integer.

    Raises:
        RuntimeError: the solver failed for a reason other than infeasibility or time.
    """
    package = highspy()
    if mixed:
        _run(solver)
    else:  # milliseconds
        solver.run()
    states, state, found = package.HighsModelStatus, solver.getModelStatus(), solver.getInfo()
    if state == states.kInfeasible:
        return Solution(INFEASIBLE, None, np.inf, np.inf)
    if state not in (states.kOptimal, states.kTimeLimit, states.kSolutionLimit):
        raise RuntimeError(f"HiGHS gave up: {solver.modelStatusToString(state)}")
    known = found.primal_solution_status == package.SolutionStatus.kSolutionStatusFeasible
    columns = np.array(solver.getSolution().col_value) if known else None
    objective = float(found.objective_function_value) if known else np.inf
    optimal = state == states.kOptimal
    if mixed:
        bound = float(found.mip_dual_bound)
    else:
        bound = objective if optimal else -np.inf
    status = OPTIMAL if optimal else TIME_LIMIT if state == states.kTimeLimit else NODE_LIMIT
    return Solution(status, columns, objective, bound if np.isfinite(bound) else -np.inf)


def _run(solver: Any) -> None:
    """Run the solver; Ctrl-C in the main thread stops it."""
    if threading.current_thread() is not threading.main_thread():
        solver.run()
        return
    solver.HandleUserInterrupt = True
    try:
        working = solver.startSolve()
        while working.is_alive():
            working.join(0.1)
    except KeyboardInterrupt:
        solver.cancelSolve()
        solver.wait()
        time.sleep(THREAD_ENDS_S)
        raise
