"""Playing a contest: constants are screened, responses searched, and everybody who is left meets everybody."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from itertools import product
from typing import TypeAlias

import numpy as np

from cps_agents.arena.meeting import Job, Result
from cps_agents.arena.play import Pairing, Report, finish_all, play, silent
from cps_agents.arena.sources import sources_of
from cps_agents.arena.store import Store
from cps_agents.contest.jobs import Effort, Pair, Played, Response, Screening
from cps_agents.errors import CommandError
from cps_baselines.arena import Contestant, Venue
from cps_baselines.contest import Contest, Variant
from cps_baselines.workers import Workers
from cps_envs import PROBLEMS
from cps_envs.core.errors import near
from cps_envs.core.seeds import TRAINING_START, VALIDATION
from cps_envs.core.types import ROLES, FloatArray, Role, other

Metrics: TypeAlias = dict[Pair, Mapping[str, FloatArray]]
CHUNK = 16  # constants that are screened in one piece of work
FINAL_SEED = VALIDATION.start + 500_000
SCREENING_SEED = TRAINING_START + 50_000_000  # far from the seeds of searches


def find_contests(names: Sequence[str]) -> list[Contest]:
    """The contests that the problems declare, in `baselines.<problem>.contest`.

    Raises:
        CommandError: a problem declares none.
    """
    found = []
    for name in names or PROBLEMS:
        contest = declared_contest(name)
        if contest is not None:
            found.append(contest)
        elif names:
            raise CommandError(f"{name} declares no contest: write baselines/{name}/contest.py")
    return found


def declared_contest(problem: str) -> Contest | None:
    """The contest that a problem declares; None where there is none, as for a problem of one's own."""
    module = f"cps_baselines.{problem}.contest"
    if not problem.isidentifier() or find_spec(f"cps_baselines.{problem}") is None or find_spec(module) is None:
        return None
    contest: Contest = import_module(module).CONTEST
    return contest


def choose_variants(contest: Contest, names: Sequence[str]) -> list[Variant]:
    """The variants with these names, all if there are none.

    Raises:
        CommandError: the contest has no such variant.
    """
    known = {variant.name: variant for variant in contest.variants}
    for name in names:
        if name not in known:
            raise CommandError(f"the contest of {contest.problem} has no variant {name!r}. {near(name, known)}")
    return [variant for variant in contest.variants if not names or variant.name in names]


def play_contest(
    contest: Contest,
    variant: Variant,
    effort: Effort,
    store: Store,
    workers: int,
    report: Report = silent,
) -> Played:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there.

    Only the contest's first variant is searched; in the others the policies meet and nothing else is done.
    """
    played = Played(contest, variant)
    judged = variant == contest.variants[0]
    episodes = effort.episodes or contest.episodes
    with Workers(workers) as pool:
        run = _Run(played, store, pool, report)
        if judged:
            run.prepare(effort)
            run.meet(played.validation, _choosing_pairs(played), VALIDATION.start, effort.validation_episodes)
            run.choose_responses(effort)
        run.meet(played.meetings, _pairs(played), 0, episodes)
    return played


class _Run:
    """Does pieces of work and files their results."""

    def __init__(self, played: Played, store: Store, pool: Workers, report: Report) -> None:
        self.played, self._store, self._pool, self._report = played, store, pool, report
        variant = played.variant
        self._venue = Venue(played.contest.problem, variant.preset, variant.overrides)

    def prepare(self, effort: Effort) -> None:
        """Screen the constants and search the responses."""
        played = self.played
        screenings: list[Job] = [job for role in ROLES for job in self._screenings(role, effort)]
        responses: list[Job] = list(self._responses(effort))
        scores: dict[Role, dict[str, float]] = {role: {} for role in ROLES}
        results: dict[int, Result] = {}
        for job, result in self._finish([*responses, *screenings]):
            if isinstance(job, Screening):
                scores[job.role] |= dict(zip(job.policies, result["scores"], strict=True))
            else:
                results[id(job)] = result
        for role in ROLES:
            order = sorted(played.side(role).constants, key=lambda policy: -scores[role][policy])
            played.constants[role] = [
                Contestant(f"constant {place}", policy) for place, policy in enumerate(order[: effort.finalists], 1)
            ]
        for job in responses:
            assert isinstance(job, Response)
            self._file(job, results[id(job)])

    def _file(self, job: Response, result: Result) -> None:
        played = self.played
        for each in result["found"]:
            contestant = Contestant(f"{each['search']} against {job.name}", each["policy"])
            (played.found if job.role == "attacker" else played.searched).append(contestant)
            played.searches.append({"role": job.role, "against": job.name, **each, "cpu_s": result["cpu_s"]})

    def _screenings(self, role: Role, effort: Effort) -> Iterator[Screening]:
        rivals = tuple(contestant.reference for contestant in self.played.side(other(role)).policies)
        policies = self.played.side(role).constants
        for first in range(0, len(policies), CHUNK):
            chunk = policies[first : first + CHUNK]
            yield Screening(
                self._venue, role, chunk, rivals, effort.screening_episodes, SCREENING_SEED, self._sources(rivals)
            )

    def _responses(self, effort: Effort) -> Iterator[Response]:
        contest = self.played.contest
        attacks, defences = contest.attackers, contest.defenders
        if attacks.searches:
            for place, defender in enumerate(self.played.rated("defender")):
                yield self._response("attacker", defender.name, [defender], place, effort)
        if defences.searches:
            yield self._response("defender", "all attackers", attacks.policies, len(self.played.responses), effort)

    def _response(self, role: Role, name: str, rivals: Sequence[Contestant], place: int, effort: Effort) -> Response:
        contest = self.played.contest
        references = tuple(rival.reference for rival in rivals)
        return Response(
            venue=self._venue,
            role=role,
            name=name,
            rivals=references,
            searches=self.played.side(role).searches,
            budget_s=effort.budget_s,
            episodes=contest.search_episodes,
            first_seed=TRAINING_START + place * 1_000_000,
            sources=self._sources(references),
        )

    def choose_responses(self, effort: Effort) -> None:
        """The best of each defender's leading attacks, on more episodes: means of few are misleading."""
        played = self.played
        finals: dict[Pair, Mapping[str, FloatArray]] = {}
        leading = {each.name: _leading(played, each, effort.final_responses) for each in played.rated("defender")}
        pairs = [(attack, each) for each in played.rated("defender") for attack in leading[each.name]]
        self.meet(finals, pairs, FINAL_SEED, effort.final_episodes)
        for name, attacks in leading.items():
            means = [finals[attack.name, name]["return"].mean() for attack in attacks]
            played.responses[name] = attacks[int(np.argmax(means))]

    def meet(
        self,
        into: dict[Pair, Mapping[str, FloatArray]],
        pairs: Iterable[tuple[Contestant, Contestant]],
        seed: int,
        count: int,
    ) -> None:
        """Let pairs of attacker and defender play `count` episodes from `seed` on."""
        pairings = {
            (attacker.name, defender.name): Pairing(self._venue, attacker, defender, count, seed)
            for attacker, defender in pairs
        }
        found = play(pairings, self._store, self._pool, report=self._report)
        self.played.reused += found.reused
        for pair, (result,) in found.results.items():
            self.played.cpu_s += result["cpu_s"]
            into[pair] = {name: np.array(values, np.float64) for name, values in result["metrics"].items()}

    def _finish(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Result]]:
        for done, (job, result, known) in enumerate(finish_all(jobs, self._store, self._pool), 1):
            self.played.cpu_s += result["cpu_s"]
            self.played.reused += known
            self._report(done, len(jobs), job.label)
            yield job, result

    def _sources(self, references: Sequence[str]) -> dict[str, str]:
        return sources_of(self._venue.problem, *references)


def _choosing_pairs(played: Played) -> Iterator[tuple[Contestant, Contestant]]:
    """The meetings that choices hang on."""
    attackers, defenders = played.contest.attackers.policies, played.contest.defenders.policies
    attacks = [*played.rated("attacker"), *played.constants["attacker"]]
    yield from product(attacks, defenders)
    yield from product(attackers, [*played.rated("defender"), *played.constants["defender"], *played.searched])
    yield from product(played.found, played.rated("defender"))
    yield from product(played.contest.attackers.informed, played.contest.defenders.informed)


def _pairs(played: Played) -> Iterator[tuple[Contestant, Contestant]]:
    """The meetings that are evaluated."""
    attackers, defenders = played.contest.attackers.policies, played.contest.defenders.policies
    yield from product(played.rated("attacker"), played.rated("defender"))
    constants = {role: [played.constant(role)] if played.constants.get(role) else [] for role in ROLES}
    yield from ((found, defender) for found in constants["attacker"] if found for defender in defenders)
    yield from ((attacker, found) for found in constants["defender"] if found for attacker in attackers)
    yield from product(attackers, played.searched)
    by_name = {defender.name: defender for defender in played.rated("defender")}
    yield from ((attack, by_name[name]) for name, attack in played.responses.items())


def _leading(played: Played, defender: Contestant, count: int) -> list[Contestant]:
    """The attacks that do best against a defender in the validation episodes, wherever they come from."""
    attacks = [*played.rated("attacker"), *played.found]
    return sorted(attacks, key=lambda attack: -played.validation[attack.name, defender.name]["return"].mean())[:count]
