"""Doing the chunks of the chosen parts within a time, and adding up what is known."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Event

from cps_agents.errors import CommandError
from tools.reliability.child import run_chunk
from tools.reliability.chunk import Chunk, Part, Result, stamp
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


@dataclass
class Plan:
    """The chunks of a part: what they found, which are left, and how long the part has taken."""

    part: Part
    chunks: Sequence[Chunk]
    known: dict[int, Result] = field(default_factory=dict)  # by place in `chunks`
    left: deque[int] = field(default_factory=deque)
    failed: list[str] = field(default_factory=list)
    running: int = 0

    @property
    def turn(self) -> tuple[int, float]:
        """The plan with the least of this is the next to get a process."""
        return self.running, sum(result.get("cpu_s", 0.0) for result in self.known.values())

    @property
    def findings(self) -> Findings:
        """What is known, in the order of the chunks."""
        return Findings(self.part, len(self.chunks), [self.known[place] for place in sorted(self.known)], self.failed)


def run_parts(
    parts: Sequence[Part],
    store: Store,
    minutes: float,
    report: Report | None = None,
    work: Work = run_chunk,
    jobs: int = 1,
) -> list[Findings]:
    """Do what `store` does not know, `jobs` chunks at once, until the time is over.

    The part that has taken the least time so far is the next, so that all get about the same. What has begun is
    finished. A chunk that could not be done is named, and the others go on.
    """
    plans, end = [_plan(part, store) for part in parts], time.monotonic() + 60 * minutes
    total, stop = sum(len(plan.chunks) for plan in plans), Event()
    running: dict[Future[Result], tuple[Plan, int]] = {}
    with ThreadPoolExecutor(jobs) as pool, _set_after(stop):
        while True:
            while len(running) < jobs and time.monotonic() < end and any(plan.left for plan in plans):
                plan = min((plan for plan in plans if plan.left), key=lambda plan: plan.turn)
                place = plan.left.popleft()
                stamp(plan.chunks[place])  # of the sources as they are now, which is remembered
                plan.running += 1
                running[pool.submit(work, plan.chunks[place], stop)] = plan, place
            if not running:
                return [plan.findings for plan in plans]
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                plan, place = running.pop(future)
                plan.running -= 1
                _keep(plan, place, future, store)
                if report is not None:
                    note = f"{plan.part.name}: {plan.chunks[place].row}"
                    report(sum(len(plan.known) for plan in plans), total, note)


def _plan(part: Part, store: Store) -> Plan:
    plan = Plan(part, list(part.chunks()))
    for place, chunk in enumerate(plan.chunks):
        if (known := store.get(chunk)) is None:
            plan.left.append(place)
        else:
            plan.known[place] = known
    return plan


def _keep(plan: Plan, place: int, future: Future[Result], store: Store) -> None:
    try:
        plan.known[place] = store.put(plan.chunks[place], future.result())
    except CommandError as error:
        plan.failed.append(str(error))


@contextmanager
def _set_after(stop: Event) -> Iterator[None]:
    """Tell the threads to stop, whatever happens."""
    try:
        yield
    finally:
        stop.set()
