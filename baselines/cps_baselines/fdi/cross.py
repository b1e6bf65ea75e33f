"""The reachability oracle: the highest speed at which a target can be made to collide, and a bound that proves it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from cps_baselines.fdi.continuation import Ending, program_to
from cps_baselines.fdi.enumeration import FASTER_MPS, exhaust
from cps_baselines.fdi.highs import INFEASIBLE as SOLVER_INFEASIBLE
from cps_baselines.fdi.highs import OPTIMAL, Limits, Program, solve
from cps_baselines.fdi.lifted import NEGLIGIBLE, columns_of, lift, stack, through
from cps_baselines.fdi.replay import NoReplayError, replay
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import GAP_REACHED, INFEASIBLE, PROVED, TIME_LIMIT, Record
from cps_envs.fdi.task import Task

SHARES = (0.05, 0.75, 0.2)  # of the time limit: for HiGHS, for the search of a reduced basis, for HiGHS again
Search = Callable[[FdiConfig, Record, float], Record]
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
        time_limit_s: of the search, s; 0: none. What HiGHS leaves open at once is searched in a reduced basis, see
            `exhausted`; then HiGHS goes on with the best attack, which lowers the bound.
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
    points = [] if start is None else [columns_of(config, task.sensors).inverse @ start.reshape(-1).astype(np.float64)]
    value_mps, injections = replayed(config, task, points)
    record = Record(task, lp_mps, value_mps, lp_mps, TIME_LIMIT, 0.0, injections)
    again: Search = partial(branched, gap=gap)
    searches: tuple[Search, ...] = (again, exhausted, again)
    for search, share in zip(searches, SHARES, strict=True):
        if record.status == TIME_LIMIT and time_limit_s > 0:
            record = search(config, record, share * time_limit_s)
    return replace(record, wall_s=time.perf_counter() - started)


def branched(config: FdiConfig, record: Record, time_limit_s: float, gap: float = 0.0) -> Record:
    """A record after HiGHS has searched for so long, or up to a relative gap, beginning with its attack."""
    task, columns = record.task, columns_of(config, record.task.sensors)
    start = record.injections
    point = None if start is None else columns.inverse @ start.reshape(-1).astype(np.float64)
    limits = Limits(time_limit_s, relative_gap=gap)
    found = solve(crossing_program(config, task), limits, point)
    points = [point, found.columns]
    if found.columns is not None and replayed(config, task, [found.columns])[0] is None:
        points.append(solve(crossing_program(config, task, strict=True), limits, point).columns)
    value_mps, injections = replayed(config, task, points)
    bound_mps = checked(min(record.bound_mps, _speed(found.bound)), value_mps, task)
    better = replace(record, value_mps=value_mps, bound_mps=bound_mps, injections=injections)
    return replace(better, status=status_of(better, found.status))


def exhausted(config: FdiConfig, record: Record, time_limit_s: float) -> Record:
    """A record after an exhaustive search, of so many CPU seconds, for something better."""
    task, program, columns = record.task, crossing_program(config, record.task), columns_of(config, record.task.sensors)
    moving = np.abs(lift(config, task.sensors).errors[1:].reshape(-1, len(program.cost)) @ columns.transform)
    passive = moving.max(axis=0) < NEGLIGIBLE
    best_mps = -1.0 if record.value_mps is None else record.value_mps
    found = exhaust(program, passive, best_mps, lambda point: replayed(config, task, [point])[0], time_limit_s)
    if found.best is not None:
        value_mps, injections = replayed(config, task, [found.best])
        record = replace(record, value_mps=value_mps, injections=injections)
    if not found.finished:
        return record
    if record.value_mps is None and found.bound_mps <= FASTER_MPS:
        return replace(record, bound_mps=0.0, status=INFEASIBLE)
    bound_mps = checked(min(record.bound_mps, found.bound_mps), record.value_mps, task)
    record = replace(record, bound_mps=bound_mps)
    return replace(record, status=status_of(record))


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
