"""Playing a benchmark: what is to be done, what was done before, and doing the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from importlib.util import find_spec
from typing import TypeVar

from cps_agents.benchmark.cell import Cell, Job, Preparation, Result, make_cell, make_preparation, run_job
from cps_agents.benchmark.store import Store
from cps_agents.errors import CommandError, explain
from cps_agents.zoo.references import is_missing
from cps_baselines.schedule import Benchmark, Entrant, Setting
from cps_baselines.workers import Workers
from cps_envs import PROBLEMS
from cps_envs.core.errors import near

Report = Callable[[int, int, str], None]  # jobs done, jobs in all, the last one
QUICK_EPISODES = 2
AnyJob = TypeVar("AnyJob", bound=Job)
Meeting = tuple[str, str, str]  # setting, attacker, defender


@dataclass
class Outcome:
    """A benchmark with what came out."""

    benchmark: Benchmark
    cells: dict[Meeting, Result] = field(default_factory=dict)
    preparations: dict[tuple[str, str], Result] = field(default_factory=dict)  # by setting and entrant
    reused: int = 0  # jobs found finished
    jobs: int = 0


def find_benchmarks(names: Sequence[str]) -> list[Benchmark]:
    """The benchmarks that the problems declare, in `baselines.<problem>.benchmark`."""
    packages = [f"cps_baselines.{name}" for name in names or PROBLEMS]
    modules = [f"{package}.benchmark" for package in packages if find_spec(package) is not None]
    return [_shipped(import_module(module).BENCHMARK) for module in modules if find_spec(module) is not None]


def _shipped(benchmark: Benchmark) -> Benchmark:
    """The benchmark without entrants whose trained policy is not there, and a note that says so."""
    entrants = [each for setting in benchmark.settings for each in (*setting.attackers, *setting.defenders)]
    missing = dict.fromkeys(each.reference for each in entrants if is_missing(each.reference))
    if not missing:
        return benchmark

    def present(entrants: Sequence[Entrant]) -> tuple[Entrant, ...]:
        return tuple(entrant for entrant in entrants if entrant.reference not in missing)

    settings = tuple(
        replace(setting, attackers=present(setting.attackers), defenders=present(setting.defenders))
        for setting in benchmark.settings
    )
    note = f"Left out, because no such trained policy is shipped: {', '.join(missing)}."
    return replace(benchmark, settings=settings, notes=(*benchmark.notes, note))


def select(benchmark: Benchmark, wanted: Mapping[str, Sequence[str]], quick: bool) -> Benchmark:
    """The part of a benchmark with the wanted `setting`, `attacker` and `defender` names; empty = all.

    `quick` plays few episodes.

    Raises:
        CommandError: a name that the benchmark does not have.
    """
    settings = _chosen("setting", benchmark.settings, wanted["setting"])
    attackers = {entrant.name for setting in settings for entrant in setting.attackers}
    defenders = {entrant.name for setting in settings for entrant in setting.defenders}
    for kind, known in (("attacker", attackers), ("defender", defenders)):
        for name in wanted[kind]:
            if name not in known:
                raise CommandError(f"the benchmark of {benchmark.problem} has no {kind} {name!r}. {near(name, known)}")
    kept = [_narrowed(setting, wanted, quick) for setting in settings]
    return replace(benchmark, settings=tuple(setting for setting in kept if setting.attackers and setting.defenders))


def _chosen(kind: str, settings: Sequence[Setting], names: Sequence[str]) -> list[Setting]:
    known = [setting.name for setting in settings]
    for name in names:
        if name not in known:
            raise CommandError(f"the benchmark has no {kind} {name!r}. {near(name, known)}")
    return [setting for setting in settings if not names or setting.name in names]


def _narrowed(setting: Setting, wanted: Mapping[str, Sequence[str]], quick: bool) -> Setting:
    def keep(entrants: Sequence[Entrant], names: Sequence[str]) -> tuple[Entrant, ...]:
        return tuple(entrant for entrant in entrants if not names or entrant.name in names)

    few = {name: min(count, QUICK_EPISODES) for name, count in setting.more_episodes.items()}
    return replace(
        setting,
        attackers=keep(setting.attackers, wanted["attacker"]),
        defenders=keep(setting.defenders, wanted["defender"]),
        episodes=min(setting.episodes, QUICK_EPISODES) if quick else setting.episodes,
        more_episodes=few if quick else setting.more_episodes,
    )


def run_benchmark(
    benchmark: Benchmark, store: Store, *, workers: int, quick: bool = False, report: Report | None = None
) -> Outcome:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there."""
    outcome = Outcome(benchmark)
    preparations = list(_preparations(benchmark, quick))
    cells = sorted(_cells(benchmark), key=lambda job: -job.episodes)  # the long ones first
    waiting = {(job.setting, job.entrant) for job in preparations}
    ready = [job for job in cells if waiting.isdisjoint(_entrants(job))]
    outcome.jobs = len(preparations) + len(cells)
    with Workers(workers) as pool:
        first: list[Cell | Preparation] = [*preparations, *ready]
        for job, result, known in finish_all(first, store, pool):
            _file(job, result, known, outcome, report)
        rest = [_prepared(job, outcome) for job in cells if not waiting.isdisjoint(_entrants(job))]
        for job, result, known in finish_all(rest, store, pool):
            _file(job, result, known, outcome, report)
    return outcome


def _preparations(benchmark: Benchmark, quick: bool) -> Iterator[Preparation]:
    for setting in benchmark.settings:
        for entrant in (*setting.attackers, *setting.defenders):
            if entrant.prepare:
                yield make_preparation(benchmark.problem, setting, entrant, quick)


def _cells(benchmark: Benchmark) -> Iterator[Cell]:
    for setting in benchmark.settings:
        for attacker in setting.attackers:
            for defender in setting.defenders:
                episodes = setting.episodes_of(attacker.name)
                yield make_cell(benchmark.problem, setting, attacker, defender, episodes)


def _entrants(job: Cell) -> set[tuple[str, str]]:
    return {(job.setting, job.attacker), (job.setting, job.defender)}


def _prepared(job: Cell, outcome: Outcome) -> Cell:
    attacker = outcome.preparations.get((job.setting, job.attacker), {"policy": job.attacker_policy})
    defender = outcome.preparations.get((job.setting, job.defender), {"policy": job.defender_policy})
    return replace(job, attacker_policy=attacker["policy"], defender_policy=defender["policy"])


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


def attempt(job: Job) -> Result:
    """The result of a job; errors that the user can put right tell which job had them."""
    try:
        return run_job(job)
    except Exception as error:
        message = explain(error)
        if message is None:
            raise
        raise CommandError(f"{job.label}: {message}") from error


def _file(job: Cell | Preparation, result: Result, known: bool, outcome: Outcome, report: Report | None) -> None:
    outcome.reused += known
    if isinstance(job, Cell):
        outcome.cells[job.setting, job.attacker, job.defender] = result
    else:
        outcome.preparations[job.setting, job.entrant] = result
    if report is not None:
        report(len(outcome.cells) + len(outcome.preparations), outcome.jobs, job.label.removeprefix(f"{job.problem} "))
