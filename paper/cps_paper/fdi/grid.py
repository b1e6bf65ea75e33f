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

from cps_baselines.fdi.highs import INFEASIBLE, OPTIMAL, Limits, Program, Solution, solve
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
        found = nearest(legal, largest, ends, goal, time_limit_s)
        statuses.append(PROVED if found.status == OPTIMAL else found.status)
        if found.columns is None:
            continue
        levels: IntArray = np.rint(found.columns[:-1]).astype(np.int64)
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


def nearest(legal: Rows, levels: FloatArray, ends: FloatArray, goal: FloatArray, time_limit_s: float) -> Solution:
    """The legal injections z (columns,), |z| <= levels, that bring y = ends @ z nearest to the goal; from rest.

    y (2,) and the goal are e_x,t(m) in m and e_v,t(m) in m/s. HiGHS has no mixed-integer quadratic programs: it
    minimises the larger of both distances instead, which is the last column.
    """
    size, free, one = len(levels), np.full(2, np.inf), np.ones((2, 1))
    ends = np.where(np.abs(ends) < NEGLIGIBLE, 0.0, ends)
    both = sparse.csr_matrix(np.vstack([np.hstack([ends, -one]), np.hstack([ends, one])]))
    own = sparse.hstack([legal.matrix, sparse.csr_matrix((legal.matrix.shape[0], 1))])
    rows = Rows(
        sparse.vstack([own, both], "csr"),
        np.concatenate([legal.lower, -free, goal]),
        np.concatenate([legal.upper, goal, free]),
        np.zeros((own.shape[0] + 4, legal.drift.shape[1])),
    )
    surrogate = Program(
        np.eye(size + 1)[size], rows, np.append(-levels, 0.0), np.append(levels, np.inf), np.arange(size + 1) < size
    )
    return solve(surrogate, Limits(time_limit_s, relative_gap=0.0, absolute_gap=SURROGATE_GAP))
