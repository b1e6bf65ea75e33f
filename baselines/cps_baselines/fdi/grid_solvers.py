"""The grid-target problem (3.55), corrected, by three solvers: legal integer injections that end nearest to a point."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from cps_baselines.fdi.highs import INFEASIBLE, OPTIMAL, TIME_LIMIT, Limits, Program, solve
from cps_baselines.fdi.lifted import NEGLIGIBLE, Rows
from cps_baselines.optional import optional
from cps_envs.core.errors import near, require
from cps_envs.core.types import FloatArray

SURROGATE_GAP = 0.03  # absolute, of the largest of the two distances, m and m/s
QUADRATIC_GAP = 1e-4  # relative, of the objective without its constant


class GridProgram(NamedTuple):
    """Legal injections z (columns,) that bring y = ends @ z near the goal; from rest."""

    rows: Rows
    levels: FloatArray  # (columns,) largest |z|
    ends: FloatArray  # (2, columns): e_x,t(m) in m and e_v,t(m) in m/s
    goal: FloatArray  # (2,): -x_d and the speed of the grid


class GridPoint(NamedTuple):
    """What a solver found; `status` is "optimal", "infeasible" or "time limit"."""

    status: str
    columns: FloatArray | None


Solver = Callable[[GridProgram, float], GridPoint]


def solve_highs(program: GridProgram, time_limit_s: float) -> GridPoint:
    """HiGHS has no mixed-integer quadratic programs: minimise the larger of both distances instead."""
    size = len(program.levels)
    ends = np.where(np.abs(program.ends) < NEGLIGIBLE, 0.0, program.ends)
    one = np.ones((2, 1))
    both = sparse.csr_matrix(np.vstack([np.hstack([ends, -one]), np.hstack([ends, one])]))
    goal, free = program.goal, np.full(2, np.inf)
    legal = sparse.hstack([program.rows.matrix, sparse.csr_matrix((program.rows.matrix.shape[0], 1))])
    rows = Rows(
        sparse.vstack([legal, both], "csr"),
        np.concatenate([program.rows.lower, -free, goal]),
        np.concatenate([program.rows.upper, goal, free]),
        np.zeros((legal.shape[0] + 4, program.rows.drift.shape[1])),
    )
    surrogate = Program(
        np.eye(size + 1)[size],
        rows,
        np.append(-program.levels, 0.0),
        np.append(program.levels, np.inf),
        np.arange(size + 1) < size,
    )
    found = solve(surrogate, Limits(time_limit_s, relative_gap=0.0, absolute_gap=SURROGATE_GAP))
    return GridPoint(found.status, None if found.columns is None else found.columns[:size])


def solve_scip(program: GridProgram, time_limit_s: float) -> GridPoint:
    """The quadratic program itself, by SCIP; the objective becomes a variable above 1/2 y'y - goal'y."""
    scip = require("pyscipopt", extra="scip", purpose="the grid back end 'scip'")
    model = scip.Model()
    model.hideOutput()
    model.setParam("limits/time", time_limit_s)
    model.setParam("limits/gap", QUADRATIC_GAP)
    model.setParam("parallel/maxnthreads", 1)
    z = [model.addVar(vtype="I", lb=-bound, ub=bound) for bound in program.levels]
    y = [model.addVar(lb=None) for _ in program.goal]
    objective = model.addVar(lb=None)
    for expression, low, high in _expressions(program.rows, z, scip.quicksum):
        if np.isfinite(low):
            model.addCons(expression >= low)
        if np.isfinite(high):
            model.addCons(expression <= high)
    for end, row in zip(y, program.ends, strict=True):
        model.addCons(scip.quicksum(_terms(row, z)) == end)
    model.addCons(_quadratic(y, program.goal) <= objective)
    model.setObjective(objective)
    model.optimize()
    status = {"optimal": OPTIMAL, "gaplimit": OPTIMAL, "infeasible": INFEASIBLE}.get(model.getStatus(), TIME_LIMIT)
    if model.getNSols() == 0:
        return GridPoint(status, None)
    best = model.getBestSol()
    return GridPoint(status, np.array([best[v] for v in z]))


def solve_cplex(program: GridProgram, time_limit_s: float) -> GridPoint:
    """The quadratic program itself, by CPLEX; its free edition takes up to 1000 rows and columns."""
    docplex = optional("docplex.mp.model", install="docplex cplex", purpose="the grid back end 'cplex'")
    optional("cplex", install="docplex cplex", purpose="the grid back end 'cplex'")
    model = docplex.Model()
    model.parameters.timelimit = time_limit_s
    model.parameters.threads = 1
    z = model.integer_var_list(len(program.levels), lb=list(-program.levels), ub=list(program.levels))
    y = model.continuous_var_list(2, lb=-model.infinity)
    for expression, low, high in _expressions(program.rows, z, model.sum):
        if np.isfinite(low):
            model.add_constraint(expression >= low)
        if np.isfinite(high):
            model.add_constraint(expression <= high)
    for end, row in zip(y, program.ends, strict=True):
        model.add_constraint(
            model.sum(float(a) * v for a, v in zip(row, z, strict=True) if abs(a) >= NEGLIGIBLE) == end
        )
    model.minimize(_quadratic(y, program.goal))
    found = model.solve()
    status = model.solve_details.status
    known = OPTIMAL if "optimal" in status else INFEASIBLE if "infeasible" in status else TIME_LIMIT
    return GridPoint(known, None if found is None else np.array(found.get_values(z)))


def _expressions(rows: Rows, z: list[Any], total: Callable[..., Any]) -> list[tuple[Any, float, float]]:
    """Rows that hold anything, as sums over the variables, with their limits."""
    matrix, found = rows.matrix, []
    for row, (low, high) in enumerate(zip(rows.lower, rows.upper, strict=True)):
        part = slice(matrix.indptr[row], matrix.indptr[row + 1])
        if part.stop > part.start:
            terms = zip(matrix.data[part], matrix.indices[part], strict=True)
            found.append((total(float(a) * z[j] for a, j in terms), float(low), float(high)))
    return found


def _terms(row: FloatArray, z: list[Any]) -> list[Any]:
    """Products of the coefficients that count with their variables."""
    return [float(a) * v for a, v in zip(row, z, strict=True) if abs(a) >= NEGLIGIBLE]


def _quadratic(y: list[Any], goal: FloatArray) -> Any:
    """1/2 y'y - goal'y, without the constant of the distance."""
    return sum(0.5 * end * end - float(aim) * end for end, aim in zip(y, goal, strict=True))


SOLVERS: Mapping[str, Solver] = {"highs": solve_highs, "scip": solve_scip, "cplex": solve_cplex}


def find_solver(back_end: str) -> Solver:
    """The solver of a name.

    Raises:
        ValueError: none has this name.
    """
    if back_end not in SOLVERS:
        raise ValueError(f"There is no grid back end {back_end!r}. {near(back_end, SOLVERS)}")
    return SOLVERS[back_end]
