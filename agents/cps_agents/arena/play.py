"""Playing whatever is asked for: each meeting once, preparations first, and only what the store does not have."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from cps_agents.arena.meeting import Job, Meeting, Preparation, Result, attempt, make_meeting, make_preparation
from cps_agents.arena.store import Store, file_name
from cps_agents.zoo.references import SB3, by_training_seed
from cps_baselines.arena import Contestant, Venue
from cps_baselines.workers import Workers
from cps_envs.core.types import ROLES, Role

Report = Callable[[int, int, str], None]  # jobs done, jobs in all, the last one
Key = TypeVar("Key", bound=Hashable)
AnyJob = TypeVar("AnyJob", bound=Job)
QUICK_EPISODES = 2


def silent(done: int, total: int, label: str) -> None:
    """Report nothing."""


@dataclass(frozen=True)
class Pairing:
    """Two contestants who are to meet in a venue; a trained one of the role `every_seed` with all training seeds."""

    venue: Venue
    attacker: Contestant
    defender: Contestant
    episodes: int
    first_seed: int = 0
    every_seed: Role | None = None
    label: str = ""

    def contestant(self, role: Role) -> Contestant:
        """Who plays a role."""
        return self.attacker if role == "attacker" else self.defender

    def preparations(self, quick: bool) -> dict[Role, Preparation]:
        """What has to be found out before they meet."""
        return {
            role: make_preparation(self.venue, mine, quick, self.label)
            for role in ROLES
            if (mine := self.contestant(role)).prepare
        }

    def meetings(self, policies: Mapping[Role, str]) -> list[Meeting]:
        """One meeting, or one for each training seed; `policies` are those that contestants have prepared."""
        players = {role: replace(self.contestant(role), policy=policy) for role, policy in policies.items()}
        pair = {role: players.get(role, self.contestant(role)) for role in ROLES}
        if self.every_seed is None:
            return [self._meeting(pair, self.label)]
        mine, label = pair[self.every_seed], self.label or f"{self.attacker.name} - {self.defender.name}"
        seeds = by_training_seed(mine.reference)
        folder = mine.reference.startswith(SB3) and None not in seeds  # which no policy can be looked up by
        if len(seeds) == 1 and not folder:  # the same meeting as without the seed's number
            return [self._meeting(pair, label)]
        return [
            self._meeting({**pair, self.every_seed: replace(mine, policy=reference)}, f"{label}, seed {seed}")
            for seed, reference in seeds.items()
        ]

    def _meeting(self, pair: Mapping[Role, Contestant], label: str) -> Meeting:
        return make_meeting(self.venue, pair["attacker"], pair["defender"], self.episodes, self.first_seed, label=label)


@dataclass
class Played(Generic[Key]):
    """The results of the meetings that were asked for, and how many of them were found finished."""

    results: dict[Key, list[Result]] = field(default_factory=dict)  # of the meetings of each pairing
    prepared: dict[tuple[Key, Role], Result] = field(default_factory=dict)
    reused: int = 0  # jobs found finished
    jobs: int = 0


def play(
    pairings: Mapping[Key, Pairing], store: Store, pool: Workers, *, quick: bool = False, report: Report = silent
) -> Played[Key]:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there."""
    results: dict[str, Result] = {}  # by the name of the job
    played: Played[Key] = Played()

    def do(jobs: Iterable[Job], later: int) -> None:
        left = {name: job for job in jobs if (name := file_name(job)) not in results}
        played.jobs = len(results) + len(left) + later
        for job, result, known in finish_all(list(left.values()), store, pool):
            results[file_name(job)] = result
            played.reused += known
            report(len(results), played.jobs, job.label)

    preparing = {key: found for key, pairing in pairings.items() if (found := pairing.preparations(quick))}
    ready = {key: pairing.meetings({}) for key, pairing in pairings.items() if key not in preparing}
    do(
        [*(job for jobs in preparing.values() for job in jobs.values()), *_longest_first(ready.values())],
        len(preparing),
    )
    for key, jobs in preparing.items():
        notes = {role: results[file_name(job)] for role, job in jobs.items()}
        played.prepared |= {(key, role): result for role, result in notes.items()}
        ready[key] = pairings[key].meetings({role: result["policy"] for role, result in notes.items()})
    do(_longest_first(ready[key] for key in preparing), 0)
    played.results = {key: [results[file_name(job)] for job in ready[key]] for key in pairings}
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
