"""The results of experiments, and computing them in this process or in several."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any, TypeVar

from baselines.disbanding.reproduction.experiments import Experiment, Experiments

Result = TypeVar("Result")
Report = Callable[[float, str], None]  # share of the work done, what was finished last


class NotRunError(LookupError):
    """The experiment was left out of this run."""


class Evidence:
    """Results by experiment, read under one interpretation."""

    def __init__(self, results: dict[Experiment[Any], Any], interpretation: str = "S0") -> None:
        self._results = results
        self.experiments = Experiments(interpretation)

    def __getitem__(self, experiment: Experiment[Result]) -> Result:
        """The result of an experiment; NotRunError where it was left out."""
        if experiment not in self._results:
            raise NotRunError(experiment.label)
        result: Result = self._results[experiment]
        return result

    def under(self, interpretation: str) -> Evidence:
        """The same results, read under another interpretation."""
        return Evidence(self._results, interpretation)


def compute(
    experiments: Iterable[Experiment[Any]], jobs: int = 1, report: Report | None = None
) -> dict[Experiment[Any], Any]:
    """Run every distinct experiment once, the long ones first, in `jobs` processes (1: in this one)."""
    todo = sorted(dict.fromkeys(experiments), key=lambda experiment: -experiment.cost)
    total, done = sum(experiment.cost for experiment in todo), 0.0
    results = {}
    for experiment, result in _in_processes(todo, jobs) if jobs > 1 else ((each, each.run()) for each in todo):
        results[experiment] = result
        done += experiment.cost
        if report is not None:
            report(done / total, experiment.label)
    return results


def _in_processes(todo: list[Experiment[Any]], jobs: int) -> Iterator[tuple[Experiment[Any], Any]]:
    spawned, others = multiprocessing.get_context("spawn"), set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(min(jobs, len(todo)), mp_context=spawned, initializer=_ignore_interrupts)
    try:
        futures = {pool.submit(_run, experiment): experiment for experiment in todo}
        for future in as_completed(futures):
            yield futures.pop(future), future.result()
    except BaseException:  # do not wait for work whose result nobody will read
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in set(multiprocessing.active_children()) - others:
            worker.terminate()
        raise
    finally:
        pool.shutdown()


def _run(experiment: Experiment[Any]) -> Any:
    return experiment.run()


def _ignore_interrupts() -> None:
    """Ctrl-C is answered by the main process alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
