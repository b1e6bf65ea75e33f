"""Doing many pieces of work, in this process, in several or on other machines."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import connection, parent_process
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from cps_agents.interruption import FIRST_SIGNAL_CODE, end, exit_code
from cps_envs.core.declare.foreign import ForeignSettingWarning

if TYPE_CHECKING:
    from cps_agents.cluster import Cluster

SIGNAL_S = 1.0  # in which a signal reaches all processes of a group
Item = TypeVar("Item")
Result = TypeVar("Result")
Where: TypeAlias = "int | Cluster"  # so many processes of this machine, or the machines of a cluster


class Workers:
    """A context in which work is done by processes, or by a cluster; with one, here, one piece after the other.

    The processes are spawned, so a script that uses several must guard its main part, and functions, items and results
    must be such that they can be pickled. An error or Ctrl-C inside the context cancels the work that is left and ends
    the context's own processes: in work that has begun, SIGTERM raises KeyboardInterrupt, so that it can keep what it
    has. The processes also end when this one is killed. A cluster does a piece again whose worker or machine has died.

    Args:
        where: how many processes, or which cluster.
        pieces: of work, if that is known: no more processes than that.
    """

    def __init__(self, where: Where, pieces: int | None = None) -> None:
        self._spawning = _Spawning()
        self._pool: Executor | None = None
        self._ours = isinstance(where, int)
        if not isinstance(where, int):
            self._pool = where.executor()
        elif (count := where if pieces is None else min(where, pieces)) > 1:
            self._pool = ProcessPoolExecutor(count, mp_context=self._spawning, initializer=_listen)

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
        work = partial(_work, function) if self._ours else function
        futures = {self._pool.submit(work, item): item for item in items}
        for future in as_completed(futures):
            try:
                result = future.result()
            except BrokenProcessPool:
                time.sleep(SIGNAL_S)  # a signal to the whole group may be on its way to this process, too
                raise
            yield futures.pop(future), result


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


_working = False  # whether this process has work, which wants to keep what it has before it ends


def _listen() -> None:
    """In a new process: Ctrl-C is answered by the main process alone, which then ends the others by SIGTERM.

    So does the end of the main process, however it died. Of foreign numbers the main process tells.
    """
    warnings.simplefilter("ignore", ForeignSettingWarning)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)


def _end(number: int, frame: FrameType | None) -> None:
    if not _working:
        os._exit(FIRST_SIGNAL_CODE + number)
    end(number, frame)


def _work(function: Callable[[Item], Result], item: Item) -> Result:
    """Do a piece of work in a process of its own; once interrupted, the process takes no other piece."""
    global _working
    _working = True
    try:
        return function(item)
    except KeyboardInterrupt as error:
        os._exit(exit_code(error))
    finally:
        _working = False
