"""Playing whatever is asked for: each meeting once, preparations first, and only what the store does not have."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, TypeVar

from cps_agents.arena.meeting import Job, Meeting, Result, attempt
from cps_agents.arena.store import Store, file_name
from cps_agents.arena.table import Table
from cps_baselines.workers import Workers
from cps_envs.core.types import Role

Report = Callable[[int, int, str], None]  # jobs done, jobs in all, the last one
Place: TypeAlias = tuple[int, int, int]  # number of the table, row, column
AnyJob = TypeVar("AnyJob", bound=Job)
QUICK_EPISODES = 2


def silent(*told: object) -> None:
    """Report nothing."""


@dataclass
class Played:
    """The results of the meetings of tables, and how many of them were found finished."""

    results: dict[Place, list[Result]] = field(default_factory=dict)  # of the meetings of each pair
    prepared: dict[tuple[Place, Role], Result] = field(default_factory=dict)
    reused: int = 0  # jobs found finished
    jobs: int = 0


def play(
    tables: Sequence[Table], store: Store, pool: Workers, *, quick: bool = False, report: Report = silent
) -> Played:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there."""
    results: dict[str, Result] = {}  # by the name of the job
    played = Played()

    def do(jobs: Iterable[Job], later: int) -> None:
        left = {name: job for job in jobs if (name := file_name(job)) not in results}
        played.jobs = len(results) + len(left) + later
        for job, result, known in finish_all(list(left.values()), store, pool):
            results[file_name(job)] = result
            played.reused += known
            report(len(results), played.jobs, job.label)

    places = {(number, *pair): table for number, table in enumerate(tables) for pair in table.pairs}
    preparing = {place: found for place, table in places.items() if (found := table.preparations(place[1:], quick))}
    ready = {place: table.meetings(place[1:], {}) for place, table in places.items() if place not in preparing}
    do(
        [*(job for jobs in preparing.values() for job in jobs.values()), *_longest_first(ready.values())],
        len(preparing),
    )
    for place, jobs in preparing.items():
        notes = {role: results[file_name(job)] for role, job in jobs.items()}
        played.prepared |= {(place, role): result for role, result in notes.items()}
        policies = {role: result["policy"] for role, result in notes.items()}
        ready[place] = places[place].meetings(place[1:], policies)
    do(_longest_first(ready[place] for place in preparing), 0)
    played.results = {place: [results[file_name(job)] for job in ready[place]] for place in places}
    return played


def _longest_first(groups: Iterable[Sequence[Meeting]]) -> list[Meeting]:
    return sorted((job for jobs in groups for job in jobs), key=lambda job: -job.episodes)


def finish_all(jobs: Sequence[AnyJob], store: Store, pool: Workers) -> Iterator[tuple[AnyJob, Result, bool]]:
    """Jobs with their results, and whether `store` had them; those that it did not have are done and kept."""
    left = []
    for job in jobs:
        result = store.get(job)
        if result is None:
            left.append(job)
        else:
            yield job, result, True
    for job, result in pool.run(attempt, left):
        store.put(job, result)
        yield job, result, False
