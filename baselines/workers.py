"""Doing many pieces of work, in this process or in several."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


class Workers:
    """A context in which work is done by `count` processes; with one, in this process, one piece after the other.

    The processes are spawned, so a script that uses several must guard its main part, and functions, items and results
    must be such that they can be pickled. An error or Ctrl-C inside the context cancels the work that is left and ends
    the context's own processes.
    """

    def __init__(self, count: int) -> None:
        self._spawning = _Spawning()
        self._pool: ProcessPoolExecutor | None = None
        if count > 1:
            self._pool = ProcessPoolExecutor(count, mp_context=self._spawning, initializer=_ignore_interrupts)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._pool is None:
            return
        if kind is not None:  # do not wait for work whose result nobody will read
            self._spawning.end()
        self._pool.shutdown(cancel_futures=True)

    def run(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result]]:
        """Items with what `function` makes of them, as they get done; started in the given order.

        Raises whatever `function` raises.
        """
        if self._pool is None:
            for item in items:
                yield item, function(item)
            return
        futures = {self._pool.submit(function, item): item for item in items}
        for future in as_completed(futures):
            yield futures.pop(future), future.result()


class _Spawning(SpawnContext):
    """Starts processes as fresh interpreters and knows which ones it has started."""

    def __init__(self) -> None:
        self._started: list[BaseProcess] = []

    def Process(self, *args: Any, **kwargs: Any) -> BaseProcess:  # type: ignore[override]  # noqa: N802
        process = SpawnContext.Process(*args, **kwargs)
        self._started.append(process)
        return process

    def end(self) -> None:
        """End those that still run."""
        for process in self._started:
            if process.is_alive():
                process.terminate()


def _ignore_interrupts() -> None:
    """Ctrl-C is answered by the main process alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
