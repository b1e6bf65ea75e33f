"""Doing a chunk in a process of its own, which may crash or hang: both are results, too.

python -m tools.reliability.child PART NAME FOLDER PARENT [SKIPPED ...]
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread

from cps_agents.errors import CommandError
from tools.reliability.chunk import ROOT, Chunk, Result, find_part
from tools.reliability.journal import Journal, read_journal

DEATHS = 3  # of processes of one chunk, after which the rest of it is given up
LOOK_EVERY_S = 0.2
FAILED = "failed"
QUIET = {"CPS_ENVS_QUIET": "1", "CPS_ENVS_TRUST": "0", "OMP_NUM_THREADS": "1", "MPLBACKEND": "agg"}


class StoppedError(Exception):
    """Somebody has asked to stop; the chunk is not done."""


def run_chunk(chunk: Chunk, stop: Event) -> Result:
    """What comes of a chunk. A trial that ends its process is counted as `crash` or `hang`, and the others go on.

    Raises:
        CommandError: the chunk could not be done, through no fault of what it tries.
        StoppedError: `stop` was set before the chunk was done.
    """
    deaths: Result = {"counts": {}, "examples": {}}
    skipped: list[int] = []
    while True:
        with tempfile.TemporaryDirectory(prefix="reliability-") as name:
            folder = Path(name)
            ended = _attempt(chunk, folder, skipped, stop)
            result = folder / "result.json"
            if ended == "done":
                found: Result = json.loads(result.read_text(encoding="utf-8"))
                return _together(found, deaths)
            number, what = read_journal(folder / "journal")
            words = (folder / "errors").read_text(encoding="utf-8", errors="replace")[-1500:]
        if ended == FAILED:
            raise CommandError(f"{chunk.part}, {chunk.row} {chunk.number} could not be done: {words}")
        kind = "hang" if ended == "hang" else "crash"
        deaths["counts"][kind] = deaths["counts"].get(kind, 0) + 1
        deaths["examples"].setdefault(kind, f"{chunk.row} {chunk.number}, trial {number}: {what}; {ended} {words}")
        skipped.append(number)
        if len(skipped) >= DEATHS or number < 0:
            return deaths


def _attempt(chunk: Chunk, folder: Path, skipped: list[int], stop: Event) -> str:
    """Run a process to its end: "done", "hang", or how it died."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, **QUIET, "PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, "-m", "tools.reliability.child", chunk.part, chunk.name, str(folder)]
    command += map(str, (os.getpid(), *skipped))
    with (folder / "errors").open("wb") as errors:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env=environment,
            stdout=errors,
            stderr=errors,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            return "hang" if not _wait(child, chunk.limit_s, stop) else _ending(child, folder)
        finally:
            _end(child)


def _wait(child: subprocess.Popen[bytes], limit_s: float, stop: Event) -> bool:
    """Wait for the end of a process; False if it takes too long.

    Raises:
        StoppedError: `stop` was set.
    """
    end = time.monotonic() + limit_s
    while child.poll() is None:
        if stop.wait(LOOK_EVERY_S):
            raise StoppedError
        if time.monotonic() > end:
            return False
    return True


def _ending(child: subprocess.Popen[bytes], folder: Path) -> str:
    if child.returncode == 0 and (folder / "result.json").is_file():
        return "done"
    if child.returncode == 1:
        return FAILED  # with a traceback: errors of what is tried are caught
    return f"ended by signal {-child.returncode}" if child.returncode < 0 else f"ended with {child.returncode}"


def _end(child: subprocess.Popen[bytes]) -> None:
    """End what is left of a process and of those that it started."""
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def _together(one: Result, other: Result) -> Result:
    counts = dict(one["counts"])
    for name, count in other["counts"].items():
        counts[name] = counts.get(name, 0) + count
    return {**one, "counts": counts, "examples": {**other["examples"], **one.get("examples", {})}}


def _watch(parent: int) -> None:
    """End this process, and those that it has started, when its parent is gone."""
    while os.getppid() == parent:
        time.sleep(LOOK_EVERY_S)
    os.killpg(0, signal.SIGKILL)


def main() -> None:
    """Do the chunk that the command line names, and write its result into the folder."""
    part_name, name, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    parent, *skipped = map(int, sys.argv[4:])
    journal = Journal(folder / "journal", skipped)
    Thread(target=_watch, args=(parent,), daemon=True).start()
    part = find_part(part_name)
    chunk = next(each for each in part.chunks() if each.name == name)
    result = part.run(chunk, journal)
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    main()
