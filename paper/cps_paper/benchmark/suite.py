"""The benchmark of a problem: which attackers meet which defenders where, and what came out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec

from cps_agents.arena.challenge import able, usual
from cps_agents.arena.meeting import Result, attempt
from cps_agents.arena.play import QUICK_EPISODES, Pairing, Played, Report, play, silent
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_baselines.arena import Contestant, Venue
from cps_baselines.workers import Workers
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.errors import near
from cps_envs.core.types import Role
from cps_paper.benchmark.schedule import Benchmark, Setting

Place = tuple[str, str, str]  # setting, attacker, defender
DERIVED_EPISODES = 20


@dataclass
class BenchmarkOutcome:
    """A benchmark with what came out."""

    benchmark: Benchmark
    played: Played[Place]

    def result(self, place: Place) -> Result:
        """What the meeting of an attacker and a defender in a setting gave."""
        (found,) = self.played.results[place]
        return found

    def preparations(self, setting: str) -> dict[str, Result]:
        """What the contestants of a setting found out in advance, by name."""
        names = {"attacker": 1, "defender": 2}
        prepared = self.played.prepared.items()
        return {key[names[role]]: found for (key, role), found in prepared if key[0] == setting}


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
        settings=tuple(
            Setting(
                name=preset,
                title=f"Preset {preset}",
                metric="return",
                venue=(venue := Venue(name, preset)),
                attackers=_able(venue, "attacker"),
                defenders=_able(venue, "defender"),
                episodes=DERIVED_EPISODES,
                legend=f"what the attacker is paid{f' in {problem.unit}' if problem.unit else ''}, mean over episodes",
            )
            for preset in problem.presets
        ),
        notes=(f"{problem.name} declares no benchmark: every policy that can play meets every other in each preset.",),
    )


def _able(venue: Venue, role: Role) -> tuple[Contestant, ...]:
    return able(venue, role, usual(venue, role))


@dataclass(frozen=True)
class BenchmarkChoice:
    """Which part of a benchmark is played; empty means all."""

    tables: Sequence[str] = ()  # settings, or tables that several settings share
    attackers: Sequence[str] = ()
    defenders: Sequence[str] = ()
    quick: bool = False  # few episodes
    full: bool = True  # also what takes long; what is named in `tables` is played anyway


def select(benchmarks: Sequence[Benchmark], choice: BenchmarkChoice) -> list[Benchmark]:
    """The chosen parts of benchmarks, without those of which nothing is left.

    Raises:
        CommandError: a name that none of them has.
    """
    settings = [setting for each in benchmarks for setting in each.settings]
    known = {
        "table": (choice.tables, [name for each in settings for name in tables_of(each)]),
        "attacker": (choice.attackers, [each.name for setting in settings for each in setting.attackers]),
        "defender": (choice.defenders, [each.name for setting in settings for each in setting.defenders]),
    }
    for kind, (names, there) in known.items():
        for name in names:
            if name not in there:
                problems = ", ".join(each.problem for each in benchmarks)
                raise CommandError(
                    f"the benchmark of {problems} has no {kind} {name!r}. {near(name, dict.fromkeys(there))}"
                )
    found = [replace(each, settings=tuple(_chosen(each.settings, choice))) for each in benchmarks]
    return [each for each in found if each.settings]


def tables_of(setting: Setting) -> tuple[str, ...]:
    """The names under which a setting can be chosen."""
    return (setting.name, *([setting.table.name] if setting.table else []))


def _chosen(settings: Sequence[Setting], choice: BenchmarkChoice) -> Iterator[Setting]:
    for setting in settings:
        named = bool(set(tables_of(setting)) & set(choice.tables))
        narrowed = _narrowed(setting, choice)
        wanted = named or (not choice.tables and (choice.full or not setting.only_full))
        if wanted and narrowed.attackers and narrowed.defenders:
            yield narrowed


def _narrowed(setting: Setting, choice: BenchmarkChoice) -> Setting:
    def keep(contestants: Sequence[Contestant], names: Sequence[str]) -> tuple[Contestant, ...]:
        return tuple(each for each in contestants if not names or each.name in names)

    few: Mapping[str, int] = {name: min(count, QUICK_EPISODES) for name, count in setting.more_episodes.items()}
    return replace(
        setting,
        attackers=keep(setting.attackers, choice.attackers),
        defenders=keep(setting.defenders, choice.defenders),
        episodes=min(setting.episodes, QUICK_EPISODES) if choice.quick else setting.episodes,
        more_episodes=few if choice.quick else setting.more_episodes,
    )


def run_benchmark(
    benchmark: Benchmark, store: Store, *, workers: int, quick: bool = False, report: Report = silent
) -> BenchmarkOutcome:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there."""
    with Workers(workers) as pool:
        return BenchmarkOutcome(benchmark, play(dict(pairings(benchmark)), store, pool, quick=quick, report=report))


def compile_kernels(benchmarks: Sequence[Benchmark], store: Store, workers: int, report: Report = silent) -> None:
    """Play a short meeting of each problem that is new to `store`, side by side: what they compile, others find."""
    shortest = [min(dict(pairings(each)).values(), key=_cost) for each in benchmarks if each.settings]
    jobs = [job for pairing in shortest for job in pairing.meetings({}) if store.get(job) is None]
    if workers > 1 and len(jobs) > 1:
        with Workers(min(workers, len(jobs))) as pool:
            report(0, len(jobs), "compiling kernels")
            for done, (job, _) in enumerate(pool.run(attempt, jobs), start=1):
                report(done, len(jobs), job.venue.problem)


def _cost(pairing: Pairing) -> tuple[bool, int]:
    return bool(pairing.attacker.prepare or pairing.defender.prepare), pairing.episodes


def pairings(benchmark: Benchmark) -> Iterator[tuple[Place, Pairing]]:
    """Everybody who meets, and where."""
    for setting in benchmark.settings:
        for attacker in setting.attackers:
            for defender in setting.defenders:
                yield (
                    (setting.name, attacker.name, defender.name),
                    Pairing(
                        venue=setting.venue,
                        attacker=attacker,
                        defender=defender,
                        episodes=setting.episodes_of(attacker.name),
                        label=f"{setting.name} {attacker.name} {defender.name}",
                    ),
                )
