"""The benchmark of a problem: which attackers meet which defenders where, and what came out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec

from cps_agents.arena.admission import able, usual
from cps_agents.arena.meeting import Meeting, Result, attempt
from cps_agents.arena.play import QUICK_EPISODES, Place, Played, Report, play, silent
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_agents.workers import Where, Workers
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import near
from cps_envs.core.types import Role
from cps_paper.benchmark.schedule import Benchmark

DERIVED_EPISODES = 20


@dataclass
class BenchmarkOutcome:
    """A benchmark with what came out."""

    benchmark: Benchmark
    played: Played

    def result(self, place: Place) -> Result:
        """What a meeting gave."""
        (found,) = self.played.results[place]
        return found


def find_benchmark(problem: str) -> Benchmark:
    """The benchmark that a problem declares in `cps_paper.<problem>.benchmark`, else a derived one."""
    package = f"cps_paper.{problem}"
    if problem not in PROBLEMS or find_spec(package) is None or find_spec(f"{package}.benchmark") is None:
        return derived(problem)
    found: Benchmark = import_module(f"{package}.benchmark").BENCHMARK
    return found


def derived(name: str) -> Benchmark:
    """Every registered policy of either role that can play, in each preset."""
    problem = find_problem(name)
    return Benchmark(
        problem=name,
        tables=tuple(
            Table(
                name=preset,
                title=f"Preset {preset}",
                venue=(venue := Venue(name, preset)),
                attackers=_able(venue, "attacker"),
                defenders=_able(venue, "defender"),
                episodes=DERIVED_EPISODES,
                legend=f"the attacker's return{f' in {problem.unit}' if problem.unit else ''}, mean over episodes",
            )
            for preset in problem.presets
        ),
        notes=(f"{problem.name} declares no benchmark: every policy that can play meets every other in each preset.",),
    )


def _able(venue: Venue, role: Role) -> tuple[Contestant, ...]:
    return able(venue, role, usual(venue, role))


def select(
    benchmarks: Sequence[Benchmark],
    *,
    tables: Sequence[str] = (),
    attackers: Sequence[str] = (),
    defenders: Sequence[str] = (),
    quick: bool = False,
    full: bool = True,
) -> list[Benchmark]:
    """The parts of benchmarks with these names (no names: all), without those of which nothing is left.

    `quick` plays few episodes. Without `full` what takes long is left out, unless it is named in `tables`.

    Raises:
        CommandError: a name that none of them has.
    """
    every = [table for each in benchmarks for table in each.tables]
    known = {
        "table": (tables, [each.name for each in every]),
        "attacker": (attackers, [each.name for table in every for each in table.attackers]),
        "defender": (defenders, [each.name for table in every for each in table.defenders]),
    }
    for kind, (names, there) in known.items():
        for name in names:
            if name not in there:
                problems = ", ".join(each.problem for each in benchmarks)
                raise CommandError(
                    f"the benchmark of {problems} has no {kind} {name!r}. {near(name, dict.fromkeys(there))}"
                )

    def chosen(benchmark: Benchmark) -> Iterator[Table]:
        for table in benchmark.tables:
            rows = tuple(each for each in table.attackers if not attackers or each.name in attackers)
            columns = tuple(each for each in table.defenders if not defenders or each.name in defenders)
            if rows and columns and (table.name in tables if tables else full or not table.only_full):
                left = replace(table, attackers=rows, defenders=columns)
                yield _shortened(left) if quick else left

    found = [replace(each, tables=tuple(chosen(each))) for each in benchmarks]
    return [each for each in found if each.tables]


def _shortened(table: Table) -> Table:
    attackers = tuple(replace(each, episodes=min(each.episodes, QUICK_EPISODES)) for each in table.attackers)
    return replace(table, attackers=attackers, episodes=min(table.episodes, QUICK_EPISODES))


def run_benchmark(benchmark: Benchmark, store: Store, *, workers: Where, report: Report = silent) -> BenchmarkOutcome:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there."""
    with Workers(workers) as pool:
        return BenchmarkOutcome(benchmark, play(benchmark.tables, store, pool, report=report))


def compile_kernels(benchmarks: Sequence[Benchmark], store: Store, workers: Where, report: Report = silent) -> None:
    """Play a short meeting of each problem that is new to `store`, side by side: what they compile, others find."""
    jobs = [job for each in benchmarks for job in _shortest(each) if store.get(job) is None]
    if isinstance(workers, int) and workers > 1 and len(jobs) > 1:
        with Workers(workers, len(jobs)) as pool:
            report(0, len(jobs), "compiling kernels")
            for done, (job, _) in enumerate(pool.run(attempt, jobs), start=1):
                report(done, len(jobs), job.venue.problem)


def _shortest(benchmark: Benchmark) -> list[Meeting]:
    """A meeting with the fewest episodes."""
    found = [
        (table.episodes_of(pair), number, pair) for number, table in enumerate(benchmark.tables) for pair in table.pairs
    ]
    return [benchmark.tables[number].meeting(pair) for _, number, pair in sorted(found)[:1]]
