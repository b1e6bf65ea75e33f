"""Optima of tasks by more than the integer program: annealing before it, an exhaustive search after it."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from cps_baselines.fdi.cross import checked, cross, crossing_program, relaxation_mps, replayed, status_of
from cps_baselines.fdi.lifted import NEGLIGIBLE, columns_of, lift
from cps_envs.core.types import IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import INFEASIBLE, Record
from cps_envs.fdi.task import Task
from tools.fdi.annealing import anneal
from tools.fdi.enumeration import FASTER_MPS, exhaust


def search(
    config: FdiConfig,
    task: Task,
    time_limit_s: float,
    gap: float,
    start: IntArray | None,
    *,
    plans: int = 0,
    exhaustive_s: float = 0.0,
) -> Record:
    """As `cross`, after so many plans of annealing; where it stays open, an exhaustive search of so long follows.

    A task that is proved to be out of reach is not searched.
    """
    started = time.perf_counter()
    if plans and relaxation_mps(config, task) is not None:
        start = anneal(config, task, start, plans)
    record = cross(config, task, time_limit_s, gap, start)
    if exhaustive_s > 0 and not record.closed:
        record = exhausted(config, record, exhaustive_s)
    return replace(record, wall_s=time.perf_counter() - started)


def exhausted(config: FdiConfig, record: Record, time_limit_s: float) -> Record:
    """A record after an exhaustive search for something better; see `enumeration`."""
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
