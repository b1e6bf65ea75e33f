"""The oracle over many tasks, several at a time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any

import joblib
import numpy as np
from joblib.parallel import get_active_backend

from cps_baselines.fdi.cross import Extra, cross, merged
from cps_baselines.optional import optional
from cps_envs.core.types import IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import Record
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task, all_tasks

BACKEND = "loky"


def paper_tasks(num_vehicles: int) -> Sequence[Task]:
    """Every cell of Tables 3.1 to 3.6, or of Table 3.7 and its like: one or two vehicles attacked, every target."""
    return [*all_tasks(num_vehicles, 1), *all_tasks(num_vehicles, 2)]


def open_tasks(tasks: Iterable[Task], known: Mapping[Task, Record], *, improve: bool) -> list[Task]:
    """The tasks left to solve, few sensors first: those without a record, or also those that are not closed."""
    left = [task for task in tasks if task not in known or (improve and not known[task].closed)]
    return sorted(left, key=lambda task: task.sensors.count)


def sweep(
    config: FdiConfig,
    tasks: Sequence[Task],
    known: Mapping[Task, Record],
    *,
    time_limit_s: float = 20.0,
    gap: float = 0.0,
    extra: Extra | None = None,
    jobs: int = 1,
    backend: str = BACKEND,
) -> Iterator[Record]:
    """Records of the tasks as they get done, merged with what is known already.

    A search begins with the best attack known for the task, or for fewer sensors and the same target: leaving a sensor
    alone is legal, so no task ends up below one of its parts that was done before it began.

    Args:
        config: the platoon, its limits and the horizon.
        tasks: what to solve, in this order.
        known: earlier records.
        time_limit_s: of each integer program, s.
        gap: see `cross`.
        extra: the same.
        jobs: how many at a time.
        backend: of joblib: loky, threading, multiprocessing, dask (at DASK_SCHEDULER_ADDRESS, else on this machine),
            ray, or any that was registered.

    Raises:
        MissingExtraError: the backend's package is not installed.
        ValueError: there is no such backend.
    """
    found = dict(known)
    cell = joblib.delayed(cross)
    work = (cell(config, task, time_limit_s, gap, best_start(task, list(found.values())), extra) for task in tasks)
    with ready(backend), joblib.parallel_config(backend=backend, n_jobs=jobs):
        for record in as_done(work, jobs):
            if record.task in known:
                record = merged(known[record.task], record)
            found[record.task] = record
            yield record


def as_done(work: Iterator[Any], jobs: int) -> Iterator[Any]:
    """Results of delayed calls as they get done; `jobs` at a time where the backend can only return all at once."""
    if get_active_backend()[0].supports_return_generator:
        yield from joblib.Parallel(return_as="generator_unordered", pre_dispatch="n_jobs")(work)
        return
    while some := list(islice(work, jobs)):
        yield from joblib.Parallel()(some)


def best_start(task: Task, records: Iterable[Record]) -> IntArray | None:
    """The fastest known attack (m, q) on the target with these sensors or some of them; None if there is none."""
    best_mps, best = -1.0, None
    for record in records:
        fits = record.task.target == task.target and _within(record.task.sensors, task.sensors)
        if fits and record.value_mps is not None and record.value_mps > best_mps:
            best_mps, best = record.value_mps, record
    if best is None or best.injections is None:
        return None
    levels = np.zeros((len(best.injections), task.sensors.count), np.int64)
    levels[:, _places(best.task.sensors, task.sensors)] = best.injections
    return levels


@contextmanager
def ready(backend: str) -> Iterator[None]:
    """While a backend is connected or registered that joblib does not set up by itself."""
    if backend == "dask":
        with optional("distributed", install="distributed", purpose="the backend 'dask'").Client():
            yield
        return
    if backend == "ray":
        optional("ray.util.joblib", install="ray", purpose="the backend 'ray'").register_ray()
    yield


def _within(part: Sensors, whole: Sensors) -> bool:
    return set(part.range) <= set(whole.range) and set(part.range_rate) <= set(whole.range_rate)


def _places(part: Sensors, whole: Sensors) -> list[int]:
    """Columns of the sensors of a part among those of the whole."""
    ranges = [whole.range.index(vehicle) for vehicle in part.range]
    return ranges + [len(whole.range) + whole.range_rate.index(vehicle) for vehicle in part.range_rate]
