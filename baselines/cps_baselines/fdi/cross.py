"""The reachability oracle: the highest speed at which a target can be made to collide, and a bound that proves it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cps_baselines.fdi.continuation import Ending, program_to
from cps_baselines.fdi.highs import INFEASIBLE as SOLVER_INFEASIBLE
from cps_baselines.fdi.highs import OPTIMAL, UNSOLVED, Limits, Program, solve
from cps_baselines.fdi.lifted import columns_of, stack, through
from cps_baselines.fdi.replay import NoReplayError, replay
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import GAP_REACHED, INFEASIBLE, PROVED, TIME_LIMIT, Record
from cps_envs.fdi.task import Task

POLISH_SHARE = 0.5  # of the time limit
PROVED_MPS = 1e-4  # a value this near its bound is the optimum


def crossing_program(config: FdiConfig, task: Task, *, strict: bool = False) -> Program:
    """Minimise e_v,t(m) over legal injections with e_x,t(m) <= -x_d and no collision before m, see `program_to`.

    The variables are those of `columns_of`.
    """
    columns, ending = columns_of(config, task.sensors), Ending(config.horizon, task.target - 1)
    plain = program_to(config, task.sensors, ending, strict=strict)
    rows, cost = stack([through(plain.rows, columns.transform), columns.rows]), columns.transform.T @ plain.cost
    return Program(cost, rows, -columns.bound, columns.bound, np.ones(len(cost), np.bool_))


def relaxation_mps(config: FdiConfig, task: Task) -> float | None:
    """The highest impact speed with continuous injections; None proves that the target is unreachable."""
    found = solve(replace(crossing_program(config, task), integer=None))
    return None if found.status == SOLVER_INFEASIBLE else _speed(found.objective)


def cross(
    config: FdiConfig,
    task: Task,
    time_limit_s: float = 20.0,
    gap: float = 0.0,
    start: IntArray | None = None,
) -> Record:
    """The optimum of a task at the horizon of the configuration, or a value and a bound when time is up.

    Args:
        config: the platoon, its limits and the horizon.
        task: attacked sensors and target.
        time_limit_s: of the integer program, s; 0: none. Half as much again is spent on better attacks where it stays
            open. In the rare case that its solution touches a collision before the end, a second one of this length
            follows.
        gap: the part of the value by which it may miss the bound when the search stops; 0: prove the optimum.
        start: levels (m, q) of a known attack to begin with; without effect where it does not replay.

    Raises:
        RuntimeError: a value above its bound, which would be a mistake in this program or in the solver.
        MissingExtraError: HiGHS is not installed.
    """
    started = time.perf_counter()
    lp_mps = relaxation_mps(config, task)
    if lp_mps is None:
        return Record(task, None, None, 0.0, INFEASIBLE, time.perf_counter() - started)
    limits, columns = Limits(time_limit_s, relative_gap=gap), columns_of(config, task.sensors)
    point = None if start is None else columns.inverse @ start.reshape(-1).astype(np.float64)
    program = crossing_program(config, task)
    found = solve(program, limits, point) if time_limit_s > 0 else UNSOLVED
    bound_mps, points = min(lp_mps, _speed(found.bound)), [point, found.columns]
    if found.columns is not None and replayed(config, task, [found.columns])[0] is None:
        program = crossing_program(config, task, strict=True)
        points.append(solve(program, limits, point).columns)
    value_mps, injections = replayed(config, task, points)
    if found.status == TIME_LIMIT and injections is not None:
        best = columns.inverse @ injections.reshape(-1).astype(np.float64)
        polished = polish(program, config.horizon, best, POLISH_SHARE * time_limit_s)
        value_mps, injections = replayed(config, task, [best, polished])
    bound_mps = checked(bound_mps, value_mps, task)
    record = Record(task, lp_mps, value_mps, bound_mps, TIME_LIMIT, 0.0, injections)
    return replace(record, status=status_of(record, found.status), wall_s=time.perf_counter() - started)


def merged(first: Record, second: Record) -> Record:
    """What two searches for the same optimum know together: the higher value, the lower bound."""
    better = second if (second.value_mps or -1) > (first.value_mps or -1) else first
    both = replace(better, bound_mps=min(first.bound_mps, second.bound_mps), wall_s=first.wall_s + second.wall_s)
    proved = INFEASIBLE if INFEASIBLE in (first.status, second.status) else status_of(both)
    return replace(both, status=proved if proved != TIME_LIMIT else second.status)


def _speed(objective: float) -> float:
    """Impact speed of an objective, or bound on it of a dual bound: both are e_v, closing < 0, and minimised."""
    return max(0.0, -objective)


def replayed(
    config: FdiConfig, task: Task, points: Sequence[FloatArray | None]
) -> tuple[float | None, IntArray | None]:
    """Speed and levels (m, q) of the fastest of the solutions that replay; the first of equals."""
    best_mps, best = None, None
    for point in points:
        if point is None:
            continue
        z = columns_of(config, task.sensors).transform @ np.rint(point)
        levels: IntArray = np.rint(z).astype(np.int64).reshape(config.horizon, -1)
        try:
            speed_mps = replay(config, task, levels)
        except NoReplayError:
            continue
        if best_mps is None or speed_mps > best_mps:
            best_mps, best = speed_mps, levels
    return best_mps, best


def checked(bound_mps: float, value_mps: float | None, task: Task) -> float:
    """The bound, not below the value.

    Raises:
        RuntimeError: it is clearly below it.
    """
    if value_mps is None:
        return bound_mps
    if bound_mps < value_mps - 1e-6:
        raise RuntimeError(f"{task}: the bound of {bound_mps} m/s is below the value of {value_mps} m/s")
    return max(bound_mps, value_mps)


def status_of(record: Record, solver_status: str = "") -> str:
    """What a record and its solver prove about the optimum."""
    if solver_status == SOLVER_INFEASIBLE:
        return INFEASIBLE
    if record.value_mps is not None and record.bound_mps - record.value_mps <= PROVED_MPS:
        return PROVED
    return GAP_REACHED if solver_status == OPTIMAL else TIME_LIMIT


WIDTHS = (8, 11)  # steps that are free at a time
SEARCH_S = 4.0  # for one choice of steps
GAP = 1e-4


def polish(program: Program, steps: int, variables: FloatArray, time_limit_s: float) -> FloatArray:
    """A point (columns,) of a program with step-major columns that is no worse than the feasible `variables`."""
    best, best_objective, deadline = variables, float(program.cost @ variables), time.perf_counter() + time_limit_s
    for free in _windows(steps, np.random.default_rng(0)):
        left_s = deadline - time.perf_counter()
        if left_s <= 0:
            break
        kept = ~np.repeat(free, len(best) // steps)
        lower, upper = np.where(kept, best, program.lower), np.where(kept, best, program.upper)
        found = solve(replace(program, lower=lower, upper=upper), Limits(min(SEARCH_S, left_s), GAP), best)
        if found.columns is not None and found.objective < best_objective:
            best, best_objective = np.rint(found.columns), found.objective
    return best


def _windows(steps: int, generator: np.random.Generator) -> Iterator[BoolArray]:
    """Marks (steps,) of free steps, without end: two runs of successive steps, then scattered ones."""
    while True:
        for width in WIDTHS:
            for _ in range(2):
                first = generator.integers(min(0, 2 - width), steps - 1)
                yield (np.arange(steps) >= first) & (np.arange(steps) < first + width)
            yield np.isin(np.arange(steps), generator.permutation(steps)[: width + 2])
