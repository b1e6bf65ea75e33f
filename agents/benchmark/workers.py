"""Doing many pieces of work, in this process or in several."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from types import TracebackType

from agents.benchmark.cell import Job, Result, run_job
from agents.errors import CommandError, explain


class Workers:
    """A context in which jobs run; with one worker they run in this process, one after the other."""

    def __init__(self, count: int) -> None:
        self._pool: ProcessPoolExecutor | None = None
        if count > 1:
            spawned = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(count, mp_context=spawned, initializer=_ignore_interrupts)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._pool is None:
            return
        if kind is not None:  # do not wait for work whose result nobody will read
            self._pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():
                worker.terminate()
        self._pool.shutdown()

    def run(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Result]]:
        """Jobs with their results, as they get done; started in the given order."""
        if self._pool is None:
            for job in jobs:
                yield job, _checked(job, lambda job=job: run_job(job))  # type: ignore[misc]
            return
        futures: dict[Future[Result], Job] = {self._pool.submit(run_job, job): job for job in jobs}
        for future in as_completed(futures):
            yield futures[future], _checked(futures[future], future.result)


def _checked(job: Job, result: Callable[[], Result]) -> Result:
    """The result of a job; errors that the user can put right tell which job had them."""
    try:
        return result()
    except Exception as error:
        message = explain(error)
        if message is None:
            raise
        raise CommandError(f"{job.label}: {message}") from error


def _ignore_interrupts() -> None:
    """Ctrl-C is answered by the main process alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
