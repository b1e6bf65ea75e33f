from __future__ import annotations

import math
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pytest

from cps_agents.workers import Workers
from tests.processes import is_gone, wait_until, waited

FOREVER_S = 600.0


@contextmanager
def bystander() -> Iterator[BaseProcess]:
    """A process of somebody else."""
    process = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(FOREVER_S,))
    process.start()
    try:
        yield process
    finally:
        process.terminate()
        process.join()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_every_item_comes_with_its_result(count: int) -> None:
    items = [16.0, 4.0, 25.0, 4.0]
    with Workers(count) as workers:
        found = list(workers.run(math.sqrt, items))
        assert sorted(found) == [(4.0, 2.0), (4.0, 2.0), (16.0, 4.0), (25.0, 5.0)]
        assert list(workers.run(math.sqrt, [])) == []
        assert dict(workers.run(math.floor, [2.5])) == {2.5: 2}


def test_one_works_here_and_in_the_given_order() -> None:
    with Workers(1) as workers:
        assert [result for _, result in workers.run(lambda item: (os.getpid(), item), [3, 1, 2])] == [
            (os.getpid(), item) for item in (3, 1, 2)
        ]


def test_several_work_elsewhere_and_hand_over_what_is_done_first(tmp_path: Path) -> None:
    handed_over, path = [], tmp_path / "the first is here"
    with Workers(2) as workers:
        for (waits, _), done in workers.run(waited, [(True, path), (False, path)]):
            handed_over.append((waits, done))
            path.touch()
        assert multiprocessing.active_children()
    assert handed_over == [(False, True), (True, True)]
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("count", [1, 2])
def test_an_error_reaches_the_caller(count: int) -> None:
    with pytest.raises(ValueError, match="math domain error"), Workers(count) as workers:
        list(workers.run(math.sqrt, [1.0, -1.0, 4.0]))
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_context_ends_its_own_processes_and_no_others(error: Any) -> None:
    started = time.monotonic()
    workers = Workers(2)
    with bystander() as other:
        with pytest.raises(error):
            interrupt(workers, error)
        assert multiprocessing.active_children() == [other]
    assert time.monotonic() - started < FOREVER_S / 10


def interrupt(workers: Workers, error: type[BaseException]) -> None:
    with workers:
        for _ in workers.run(time.sleep, [0.0, FOREVER_S, FOREVER_S, FOREVER_S]):
            assert len(multiprocessing.active_children()) == 3
            raise error


ENDLESS = """
import time
from cps_agents.workers import Workers

def work(seconds):
    print("working", flush=True)
    time.sleep(seconds)

if __name__ == "__main__":
    with Workers(2) as workers:
        list(workers.run(work, [600.0, 600.0]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="groups of processes of POSIX")
def test_no_process_outlives_one_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS, encoding="utf-8")
    main = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True, start_new_session=True)
    try:
        assert main.stdout is not None
        assert [main.stdout.readline() for _ in range(2)] == ["working\n"] * 2
        main.kill()
        main.wait()
        assert wait_until(lambda: is_gone(main.pid))
    finally:
        with suppress(ProcessLookupError):
            os.killpg(main.pid, signal.SIGKILL)
