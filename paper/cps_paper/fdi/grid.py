"""The grid-target problem behind the paper's tables: which grid speed can the target pair collide with?

The tables' speeds cluster at -2, -4, -6 and -8 m/s, so a printed speed is read as the largest grid speed that a solver
reached, not as the reachable maximum. Step m itself is free of all constraints but the end, as in (3.51). Three solvers
look for the legal integer injections that end nearest to a point, (3.55) corrected.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from cps_baselines.fdi.highs import INFEASIBLE, OPTIMAL, TIME_LIMIT, Limits, Program, solve
from cps_baselines.fdi.lifted import NEGLIGIBLE, Rows, end_rows, legal_rows, lift, stack, violation
from cps_baselines.optional import optional
from cps_envs.core.errors import near, require
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.task import Task

GRID_MPS = (-8.0, -6.0, -4.0, -2.0)
TOUCH_M = 0.25  # a pair with e_x(m) up to this above -x_d counts as collided
FEASIBLE = 1e-6  # largest violation of a row, m and m/s2
PROVED = "proved"


@dataclass(frozen=True)
class GridCell:
    """A cell of Tables 3.1 to 3.7, computed.

    Speeds are relative speeds e_v in m/s: negative = closing.
    """

    task: Task
    reachable: bool
    speed_mps: float | None  # of the target; None where it is not reachable
    pairs: tuple[tuple[int, float], ...]  # (i, e_v,i) of the pairs that collide, by i; the target is one of them
    distance: float | None  # of the end from the goal: of the accepted one, else the smallest that was found
    back_end: str
    statuses: tuple[str, ...]  # of each solve: "proved", "time limit" or "infeasible"
    injections: IntArray | None  # (m, q) levels
    wall_s: float

    @property
    def solves(self) -> int:
        """Integer programs that were solved; none where the relaxation is infeasible or too slow already."""
        return len(self.statuses)


def solve_cell(
    config: FdiConfig, task: Task, back_end: str = "highs", time_limit_s: float = 2.0, acceptance: float = 0.45
) -> GridCell:
    """Try the grid speeds from the highest on; accept the first with an end within `acceptance` of (-x_d, speed).

    The horizon is that of the configuration; `time_limit_s` is for each solve. Back ends: "highs" (largest of both
    distances instead of the Euclidean one), "scip" and "cplex" (the quadratic program itself).

    Raises:
        ValueError: an unknown back end.
        MissingExtraError: the back end's package is not installed.
    """
    started, find = time.perf_counter(), find_solver(back_end)
    attempt = _approach(config, task, lambda program: find(program, time_limit_s), acceptance)
    end = None
    if attempt.levels is not None:
        end = lift(config, task.sensors).errors[config.horizon] @ attempt.levels
    return GridCell(
        task=task,
        reachable=end is not None,
        speed_mps=None if end is None else float(end[config.num_vehicles + task.target - 1]),
        pairs=() if end is None else _collisions(config, task, end),
        distance=attempt.distance,
        back_end=back_end,
        statuses=attempt.statuses,
        injections=None if attempt.levels is None else attempt.levels.reshape(config.horizon, -1),
        wall_s=time.perf_counter() - started,
    )


class _Attempt(NamedTuple):
    levels: IntArray | None  # (m q,) of the accepted end
    distance: float | None  # of it, else the smallest that was found
    statuses: tuple[str, ...]


def _approach(config: FdiConfig, task: Task, find: Callable[[GridProgram], GridPoint], acceptance: float) -> _Attempt:
    """Grid speeds from the highest on, until an end lies near enough."""
    steps, rows = config.horizon, [task.target - 1, config.num_vehicles + task.target - 1]
    lifted, legal = lift(config, task.sensors), legal_rows(config, task.sensors, config.horizon)
    ends, largest = lifted.errors[steps, rows], np.tile(lifted.levels, steps).astype(np.float64)
    fastest_mps = _fastest_relaxed(config, task, legal, largest, acceptance)
    statuses, best = [], None
    for speed_mps in GRID_MPS:
        if fastest_mps > speed_mps + acceptance:
            continue
        goal = np.array([-config.desired_gap_m, speed_mps])
        point = find(GridProgram(legal, largest, ends, goal))
        statuses.append(PROVED if point.status == OPTIMAL else point.status)
        if point.columns is None:
            continue
        levels: IntArray = np.rint(point.columns).astype(np.int64)
        if violation(legal, levels) > FEASIBLE:
            continue
        distance = float(np.hypot(*(ends @ levels - goal)))
        if distance <= acceptance:
            return _Attempt(levels, distance, tuple(statuses))
        best = distance if best is None else min(best, distance)
    return _Attempt(None, best, tuple(statuses))


def _fastest_relaxed(config: FdiConfig, task: Task, legal: Rows, levels: FloatArray, acceptance: float) -> float:
    """The lowest e_v,t(m) near a collision without the resolution; inf where no collision is near."""
    steps, target, gap_m = config.horizon, task.target - 1, config.desired_gap_m
    near_collision = end_rows(config, task.sensors, steps, target, -gap_m - acceptance, -gap_m + acceptance)
    cost = lift(config, task.sensors).errors[steps, config.num_vehicles + target]
    found = solve(Program(cost, stack([legal, near_collision]), -levels, levels))
    return np.inf if found.status == INFEASIBLE else found.objective


def _collisions(config: FdiConfig, task: Task, end: FloatArray) -> tuple[tuple[int, float], ...]:
    """Pairs (i, e_v,i) that collide at the end e(m) (2n,), the target always."""
    n = config.num_vehicles
    collided = end[:n] <= -config.desired_gap_m + TOUCH_M
    return tuple((i, float(end[n + i - 1])) for i in range(1, n + 1) if collided[i - 1] or i == task.target)


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
