"""The grid-target problem behind the paper's tables: can the target pair be brought to a point of the grid?

The paper asks whether injections exist that bring the platoon near a target state; its speeds cluster at -2, -4, -6 and
-8 m/s, so that these are taken for the grid. An end counts that lies within an acceptance circle around such a point.
Step m itself is free of all constraints but the end, as in (3.51).

A circle is no linear constraint. An octagon inside it gives a plan, one around it proves that there is none. Searches
end by their number of nodes, which no machine changes; what they leave undecided is open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from cps_baselines.fdi.highs import INFEASIBLE, OPTIMAL, Limits, Program, solve
from cps_baselines.fdi.lifted import NEGLIGIBLE, Rows, columns_of, legal_rows, lift, stack, through, violation
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.task import Task

GRID_MPS = (-2.0, -4.0, -6.0, -8.0)
TOUCH_M = 0.25  # a pair with e_x(m) up to this above -x_d counts as collided
FEASIBLE = 1e-6  # largest violation of a row, m and m/s2
SIDES = 8  # of the polygons for a circle


@dataclass(frozen=True)
class GridEnd:
    """Whether the target pair of a task can be brought to a point of the grid."""

    task: Task
    hit: bool | None  # None: open
    end: tuple[float, float] | None  # (m, m/s) e_x and e_v of the target with the plan
    injections: IntArray | None  # (m, q) levels of the plan


def reach(
    config: FdiConfig, task: Task, acceptance: float = 0.45, nodes: int = 100, plan: IntArray | None = None
) -> GridEnd:
    """Look for a legal end within `acceptance` of a point of the grid, the slow points first.

    `nodes` are those of each search; `plan` (m, q) is a legal one to begin with, which may end there itself.
    """
    columns = columns_of(config, task.sensors)
    rows = [task.target - 1, config.num_vehicles + task.target - 1]
    legal = stack([through(legal_rows(config, task.sensors, config.horizon), columns.transform), columns.rows])
    ends = lift(config, task.sensors).errors[config.horizon, rows] @ columns.transform
    start = None if plan is None else columns.inverse @ plan.reshape(-1).astype(np.float64)
    settled = True
    for speed_mps in GRID_MPS:
        goal = np.array([-config.desired_gap_m, speed_mps])
        found = _approach(
            Program(np.zeros(ends.shape[1]), legal, -columns.bound, columns.bound), ends, goal, start, acceptance, nodes
        )
        if isinstance(found, bool):
            settled = settled and found
            continue
        levels: IntArray = np.rint(columns.transform @ found).astype(np.int64)
        end = ends @ found
        return GridEnd(task, True, (float(end[0]), float(end[1])), levels.reshape(config.horizon, -1))
    return GridEnd(task, False if settled else None, None, None)


def _approach(
    program: Program, ends: FloatArray, goal: FloatArray, start: FloatArray | None, acceptance: float, nodes: int
) -> FloatArray | bool:
    """Whole variables (columns,) whose end is accepted; True: there are none, False: open."""

    def accepted(point: FloatArray | None) -> bool:
        if point is None or violation(program.rows, point) > FEASIBLE:
            return False
        return bool(np.hypot(*(ends @ point - goal)) <= acceptance)

    if start is not None and accepted(start):
        return start
    around = _within(program, ends, goal, acceptance)
    if solve(around).status == INFEASIBLE:
        return True
    inside = _within(program, ends, goal, acceptance * np.cos(np.pi / SIDES))
    outcome = INFEASIBLE
    for each in (inside, around):
        found = solve(_whole(each), Limits(nodes=nodes), start)
        outcome = found.status
        if found.columns is not None and accepted(np.rint(found.columns)):
            return np.rint(found.columns)
        if outcome not in (INFEASIBLE, OPTIMAL):
            return False
    return outcome == INFEASIBLE


def _within(program: Program, ends: FloatArray, goal: FloatArray, radius: float) -> Program:
    """The program with its end in the regular polygon around the goal whose sides are `radius` away."""
    angles = np.arange(SIDES // 2) * 2 * np.pi / SIDES
    sides = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    matrix, middle = sides @ ends, sides @ goal
    matrix = sparse.csr_matrix(np.where(np.abs(matrix) < NEGLIGIBLE, 0.0, matrix))
    drift = np.zeros((len(sides), program.rows.drift.shape[1]))
    polygon = Rows(matrix, middle - radius, middle + radius, drift)
    return Program(program.cost, stack([program.rows, polygon]), program.lower, program.upper)


def _whole(program: Program) -> Program:
    return Program(program.cost, program.rows, program.lower, program.upper, np.ones(len(program.cost), np.bool_))


def collisions(config: FdiConfig, task: Task, plan: IntArray) -> tuple[int, ...]:
    """The pairs that collide at the end of a plan (m, q), by their rear vehicle; the target always."""
    n = config.num_vehicles
    gaps_m = (lift(config, task.sensors).errors[config.horizon] @ plan.reshape(-1))[:n]
    collided = gaps_m <= -config.desired_gap_m + TOUCH_M
    return tuple(i for i in range(1, n + 1) if collided[i - 1] or i == task.target)
