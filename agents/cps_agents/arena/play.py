"""Playing whatever is asked for: each meeting once, and only what the store does not have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, TypeVar

from cps_agents.arena.meeting import Job, Result, attempt
from cps_agents.arena.store import Store, file_name
from cps_agents.arena.table import Table
from cps_agents.part import Unfinished
from cps_agents.workers import Workers

Report = Callable[[int, int, str], None]  # jobs done, jobs in all, the last one
Place: TypeAlias = tuple[int, int, int]  # number of the table, row, column
AnyJob = TypeVar("AnyJob", bound=Job)
QUICK_EPISODES = 2


def silent(*told: object) -> None:
    """Report nothing."""


@dataclass
class Played:
    """The results of the meetings of tables."""

    results: dict[Place, list[Result]] = field(default_factory=dict)  # of the meetings of each pair
    jobs: int = 0  # different meetings


def play(tables: Sequence[Table], store: Store, pool: Workers, *, report: Report = silent) -> Played:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there.

    Raises:
        UnknownNameError: a table shows what no episode has; nothing has been played yet.
        Unfinished: see `finish_all`.
    """
    for table in tables:
        table.check_numbers()
    asked = {
        (number, *pair): table.meetings(pair) for number, table in enumerate(tables) for pair in table.pairs
    }  # by place
    every = {file_name(job): job for jobs in asked.values() for job in jobs}
    results: dict[str, Result] = {}
    played = Played(jobs=len(every))
    for job, result in finish_all(sorted(every.values(), key=lambda job: -job.episodes), store, pool):
        results[file_name(job)] = result
        report(len(results), played.jobs, job.label)
    played.results = {place: [results[file_name(job)] for job in jobs] for place, jobs in asked.items()}
    return played


def finish_all(jobs: Sequence[AnyJob], store: Store, pool: Workers) -> Iterator[tuple[AnyJob, Result]]:
    """Jobs with their results; those that `store` does not have are done and kept.

    Raises:
        Unfinished: the store's part is done, and the other parts have work left.
    """
    mine = set(store.part.share(range(len(jobs))))
    left: list[AnyJob] = []
    others: list[AnyJob] = []
    missing = 0
    for place, job in enumerate(jobs):
        result = store.get(job)
        if result is not None:
            yield job, result
        else:
            (left if place in mine else others).append(job)
    for job, result in pool.run(attempt, left):
        store.put(job, result)
        yield job, result
    for job in others:
        result = store.get(job)
        if result is None:
            missing += 1
        else:
            yield job, result
    if missing:
        raise Unfinished(store.part, "meetings", missing)
