"""Doing the chunks of the chosen parts within a time, and adding up what is known."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import zip_longest
from threading import Event

from cps_agents.errors import CommandError
from tools.reliability.child import run_chunk
from tools.reliability.chunk import Chunk, Part, Result
from tools.reliability.store import Store

Report = Callable[[int, int, str], None]  # chunks known, chunks in all, the last one
Work = Callable[[Chunk, Event], Result]
DEADLY = frozenset({"crash", "hang"})  # of the process of a piece: no part may have any


@dataclass
class Findings:
    """What is known of a part: its finished chunks, in order."""

    part: Part
    chunks: int  # in all
    results: Sequence[Result] = ()
    failed: Sequence[str] = ()  # what could not be done, and why

    @property
    def rows(self) -> dict[str, dict[str, float]]:
        """The sums of each row of the table."""
        table: dict[str, dict[str, float]] = {}
        for result in self.results:
            row = table.setdefault(result["row"], dict.fromkeys(self.part.columns, 0))
            for name, count in result["counts"].items():
                row[name] = row.get(name, 0) + count
        return table

    @property
    def totals(self) -> dict[str, float]:
        """The sums of the rows."""
        return {name: sum(row.get(name, 0) for row in self.rows.values()) for name in self.part.columns}

    @property
    def violations(self) -> dict[str, float]:
        """Counts that should be zero and are not."""
        deaths = {name: sum(row.get(name, 0) for row in self.rows.values()) for name in DEADLY}
        return {name: n for name, n in (self.totals | deaths).items() if name in self.part.forbidden | DEADLY and n}

    @property
    def examples(self) -> list[str]:
        """One counterexample for each forbidden column of each chunk, and other remarks."""
        found = [f"{kind}: {text}" for result in self.results for kind, text in result.get("examples", {}).items()]
        return list(dict.fromkeys(found))


def run_parts(
    parts: Sequence[Part],
    store: Store,
    minutes: float,
    report: Report | None = None,
    work: Work = run_chunk,
    jobs: int = 1,
) -> list[Findings]:
    """Do what `store` does not know, `jobs` chunks at once, until the time is over.

    The parts take turns. What has begun is finished. A chunk that could not be done is named, and the others go on.
    """
    plans = {part.name: list(part.chunks()) for part in parts}
    known = {chunk: store.get(chunk) for chunks in plans.values() for chunk in chunks}
    turns = [chunk for turn in zip_longest(*plans.values()) for chunk in turn if chunk is not None]
    left = deque(chunk for chunk in turns if known[chunk] is None)
    failed: dict[str, list[str]] = {name: [] for name in plans}
    end, stop, running = time.monotonic() + 60 * minutes, Event(), dict[Future[Result], Chunk]()
    with ThreadPoolExecutor(jobs) as pool, _set_after(stop):
        while True:
            while left and len(running) < jobs and time.monotonic() < end:
                chunk = left.popleft()
                running[pool.submit(work, chunk, stop)] = chunk
            if not running:
                break
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                chunk = running.pop(future)
                try:
                    known[chunk] = store.put(chunk, future.result())
                except CommandError as error:
                    failed[chunk.part].append(str(error))
                if report is not None:
                    report(sum(map(bool, known.values())), len(known), f"{chunk.part}: {chunk.row}")
    results = {name: [result for each in plans[name] if (result := known[each])] for name in plans}
    return [Findings(part, len(plans[part.name]), results[part.name], failed[part.name]) for part in parts]


@contextmanager
def _set_after(stop: Event) -> Iterator[None]:
    """Tell the threads to stop, whatever happens."""
    try:
        yield
    finally:
        stop.set()
