"""Commands that are killed, find no room, or meet another one: nothing finished is lost, and they can go on."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tools.reliability.chunk import CODE, Chunk, Part, Result
from tools.reliability.faults.comparing import damaged, differing, finished, lost
from tools.reliability.faults.jobs import JOBS, Ended, Job, run, start, wait, warm_up, with_small_disk
from tools.reliability.faults.killing import MOMENTS, counting, killing
from tools.reliability.journal import Journal

MOST_KILLS = {False: 60, True: 18}  # of a command that does not learn, and of one that does
SMALL_DISKS = (0, 500, 2000)  # bytes that a file may have
SLICES = 3  # of the trials of a command, each a chunk
WRONG_INPUT, INTERRUPTED = 2, 130  # exit codes: of an error that is explained, and of Ctrl-C


def chunks() -> list[Chunk]:
    """Some of the faults of each command, then some more of each."""
    sources = (*CODE, "tools/reliability/faults")
    return [Chunk("faults", job.name, number, sources, limit_s=3600) for number in range(SLICES) for job in JOBS]


class Trials:
    """The faults of one command, and what came out."""

    def __init__(self, job: Job, home: Path, journal: Journal) -> None:
        self._job, self._journal = job, journal
        self._folder, self._whole = home / "out", home / "whole"
        self.counts = dict.fromkeys(PART.columns, 0)
        self.examples: dict[str, str] = {}
        self._number = 0
        self.writes = self._uninterrupted(home / "writes")

    def _uninterrupted(self, counter: Path) -> int:
        ended = run(self._job, self._folder, counting(self._folder, counter))
        if ended.code:
            raise RuntimeError(f"{self._job.words} ends with {ended.code}: {ended.words[-500:]}")
        self._folder.rename(self._whole)
        return int(counter.read_text(encoding="utf-8"))

    def all(self) -> list[Callable[[], None]]:
        """Everything that is tried with the command."""
        places = [(number, moment) for number in range(self.writes) for moment in MOMENTS]
        step = max(1, -(-len(places) // MOST_KILLS[self._job.learns]))
        kills = [partial(self.kill, number, moment) for number, moment in places[::step]]
        stops = [partial(self.stop, number) for number in sorted({0, self.writes - 1})]
        full = [partial(self.small_disk, size) for size in SMALL_DISKS]
        return [*kills, *stops, *full, self.no_folder, self.two_writers]

    def kill(self, number: int, moment: str) -> None:
        """`kill -9` at a write."""
        fault = killing(self._folder, number, moment, signal.SIGKILL)
        self._go(f"killed {moment} write {number}", "kills", fault, self._killed)

    def stop(self, number: int) -> None:
        """Ctrl-C at a write."""
        fault = killing(self._folder, number, "before", signal.SIGINT)
        self._go(f"Ctrl-C at write {number}", "stops", fault, self._stopped)

    def small_disk(self, size: int) -> None:
        """Files that cannot grow beyond so many bytes."""
        self._go(f"files of at most {size} bytes", "full", with_small_disk(size), self._explained)

    def no_folder(self) -> None:
        """A folder that cannot be made, because a file has its name."""
        self._folder.write_text("a file", encoding="utf-8")
        ended = run(self._job, self._folder)
        self.counts["blocked"] += 1
        self._explained("a file in place of the folder", ended)
        self._folder.unlink()

    def two_writers(self) -> None:
        """The same command twice at once: both end well, or one is told that the other is at work."""
        children = [start(self._job, self._folder) for _ in range(2)]
        ended = [wait(child) for child in children]
        self.counts["pairs"] += 1
        for each in ended:
            if each.code:
                self._explained("two at once", each)
        if all(each.code for each in ended):
            self._note("unfinished", "two at once", ended[0].words)
        self._again("two at once")

    def _go(self, what: str, kind: str, fault: Callable[[], None], judge: Callable[[str, Ended], None]) -> None:
        """Run with a fault, judge how it ended, and go on without."""
        self._number += 1
        if self._journal.begin(self._number, what):
            ended = run(self._job, self._folder, fault)
            self.counts[kind] += 1
            judge(what, ended)
            self._again(what)

    def _killed(self, what: str, ended: Ended) -> None:
        if ended.code != -9:
            self._note("unfinished", what, f"the process was not killed but ended with {ended.code} {ended.words}")

    def _stopped(self, what: str, ended: Ended) -> None:
        if ended.code not in (0, INTERRUPTED) or "Traceback" in ended.words:
            self._note("unclear", what, f"exit code {ended.code}: {ended.words}")

    def _explained(self, what: str, ended: Ended) -> None:
        if ended.code not in (0, WRONG_INPUT) or "Traceback" in ended.words:
            self._note("unclear", what, f"exit code {ended.code}: {ended.words}")

    def _again(self, what: str) -> None:
        """Look at what lies there, and do the same command to its end."""
        for name in damaged(self._folder) if self._folder.is_dir() else []:
            self._note("damaged", what, name)
        before = finished(self._folder)
        ended = run(self._job, self._folder)
        done = ended.code == 0 or (self._job.once and ended.code == WRONG_INPUT)
        if not done:
            self._note("unfinished", what, f"exit code {ended.code}: {ended.words}")
        for name in lost(before, self._folder):
            self._note("lost", what, name)
        if done:
            for name in differing(self._folder, self._whole, names_only=self._job.learns):
                self._note("different", what, name)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _note(self, kind: str, what: str, how: str) -> None:
        self.counts[kind] += 1
        self.examples.setdefault(kind, f"{self._job.name}, {what}: {how[-400:]}")


def run_faults(chunk: Chunk, journal: Journal) -> Result:
    """Try some of the faults of one command."""
    job = next(each for each in JOBS if each.name == chunk.row)
    warm_up(job)
    home = Path.cwd() / "trial"
    home.mkdir()
    trials = Trials(job, home, journal)
    for trial in trials.all()[chunk.number :: SLICES]:
        trial()
    return {"counts": trials.counts, "examples": trials.examples}


PART = Part(
    name="faults",
    title="Killed commands and full disks",
    about=(
        "A tiny run of each command that writes is killed by `kill -9`: at every write, with half of a file written, "
        "and before and after the file takes its name. Training and self-play are killed at some of their writes. "
        "Ctrl-C comes at the first and the last write. "
        "Then the same command runs again to its end. Finished work must still be there, and must not be done again. "
        "The outcome must equal that of a run without a fault, times aside; training depends on where it was "
        "interrupted, so there we compare which files are written beside the meetings. The same is tried with files "
        "that cannot grow, with "
        "a file in place of the folder, and with two equal commands at once."
    ),
    columns={
        "kills": "kills",
        "stops": "Ctrl-C",
        "full": "full disks",
        "blocked": "no folder",
        "pairs": "two at once",
        "damaged": "damaged files",
        "lost": "finished work lost",
        "different": "different outcome",
        "unfinished": "could not go on",
        "unclear": "unexplained error",
    },
    forbidden=frozenset({"damaged", "lost", "different", "unfinished", "unclear"}),
    chunks=chunks,
    run=run_faults,
)
