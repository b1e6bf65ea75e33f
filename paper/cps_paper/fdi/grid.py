"""The grid-target problem behind the paper's tables: which grid speed can the target pair collide with?

The tables' speeds cluster at -2, -4, -6 and -8 m/s, so a printed speed is read as the largest grid speed that a solver
reached, not as the reachable maximum. Step m itself is free of all constraints but the end, as in (3.51). HiGHS looks
for the legal integer injections that end nearest to a point, (3.55) corrected.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from cps_baselines.fdi.highs import INFEASIBLE, OPTIMAL, Limits, Program, solve
from cps_baselines.fdi.lifted import NEGLIGIBLE, Rows, end_rows, legal_rows, lift, stack, violation
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
    statuses: tuple[str, ...]  # of each solve: "proved", "time limit" or "infeasible"
    injections: IntArray | None  # (m, q) levels
    wall_s: float


def solve_cell(config: FdiConfig, task: Task, time_limit_s: float = 2.0, acceptance: float = 0.45) -> GridCell:
    """Try the grid speeds from the highest on; accept the first with an end within `acceptance` of (-x_d, speed).

    The horizon is that of the configuration; `time_limit_s` is for each solve.
    """
    started = time.perf_counter()
    attempt = _approach(config, task, time_limit_s, acceptance)
    end = None
    if attempt.levels is not None:
        end = lift(config, task.sensors).errors[config.horizon] @ attempt.levels
    return GridCell(
        task=task,
        reachable=end is not None,
        speed_mps=None if end is None else float(end[config.num_vehicles + task.target - 1]),
        pairs=() if end is None else _collisions(config, task, end),
        distance=attempt.distance,
        statuses=attempt.statuses,
        injections=None if attempt.levels is None else attempt.levels.reshape(config.horizon, -1),
        wall_s=time.perf_counter() - started,
    )


class _Attempt(NamedTuple):
    levels: IntArray | None  # (m q,) of the accepted end
    distance: float | None  # of it, else the smallest that was found
    statuses: tuple[str, ...]


def _approach(config: FdiConfig, task: Task, time_limit_s: float, acceptance: float) -> _Attempt:
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
        point = nearest(GridProgram(legal, largest, ends, goal), time_limit_s)
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


def nearest(program: GridProgram, time_limit_s: float) -> GridPoint:
    """The injections whose end is nearest to the goal.

    HiGHS has no mixed-integer quadratic programs: it minimises the larger of both distances instead.
    """
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
