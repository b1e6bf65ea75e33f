"""Playing what blocks ask for: all cells that the store does not have, once each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module

import numpy as np

from cps_agents.benchmark.cell import Cell, Job, Preparation, Result, file_name
from cps_agents.benchmark.runner import QUICK_EPISODES, finish_all
from cps_agents.benchmark.store import Store
from cps_agents.errors import CommandError
from cps_agents.evaluation.arena import Arena
from cps_agents.results.block import Block, Contestant, Row
from cps_agents.results.rivals import completed
from cps_agents.zoo.references import missing_names
from cps_baselines.workers import Workers
from cps_envs import PROBLEMS
from cps_envs.core.errors import near

Report = Callable[[int, int, str], None]  # jobs done, jobs in all, the last one
Place = tuple[str, int, int, str]  # block, row, arena, contestant


@dataclass
class Findings:
    """What came out: the results of each training seed, and what preparations found."""

    played: dict[Place, list[Result]] = field(default_factory=dict)
    prepared: dict[Place, Result] = field(default_factory=dict)
    reused: int = 0
    jobs: int = 0


def find_blocks(problems: Sequence[str], names: Sequence[str] = ()) -> list[Block]:
    """The blocks that the problems declare in `cps_agents.results.<problem>`, completed; all if nothing is named.

    Raises:
        CommandError: there is no such block.
    """
    declared = [block for name in problems or PROBLEMS for block in import_module(f"cps_agents.results.{name}").BLOCKS]
    found = [completed(block) for block in declared if not names or block.name in names]
    known = {block.name for block in declared}
    for name in names:
        if name not in known:
            raise CommandError(f"there is no block {name!r}. {near(name, known)}")
    return found


def declared_blocks() -> dict[str, list[str]]:
    """The names of the blocks of each problem."""
    return {name: [block.name for block in import_module(f"cps_agents.results.{name}").BLOCKS] for name in PROBLEMS}


def missing_of(block: Block) -> dict[str, list[str]]:
    """The contestants, and `opponents`, whose trained policies are not there."""
    found = {each.name: missing_names(each.reference) for each in block.contestants}
    opponents = [arena.opponent for row in block.rows for arena in row.arenas]
    found["opponents"] = list(dict.fromkeys(name for opponent in opponents for name in missing_names(opponent)))
    return {name: names for name, names in found.items() if names}


def is_playable(row: Row) -> bool:
    """Whether all opponents of a row are there."""
    return not any(missing_names(arena.opponent) for arena in row.arenas)


def examine(
    blocks: Sequence[Block], store: Store, *, workers: int, quick: bool = False, report: Report | None = None
) -> Findings:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there."""
    findings = Findings()
    places = [place for block in blocks for place in _places(block, quick)]
    preparations = {at: _preparation(arena, each, quick) for at, arena, each in places if each.prepare}
    ready: dict[Place, Sequence[Job]] = {
        at: _cells(arena, each, quick) for at, arena, each in places if not each.prepare
    }
    waiting = {at: (arena, each) for at, arena, each in places if each.prepare}
    with Workers(workers) as pool:
        first: dict[Place, Sequence[Job]] = {**{at: [job] for at, job in preparations.items()}, **ready}
        findings.jobs = len(_unique(first)) + len(waiting)
        results = _work_off(first, store, pool, findings, report, {})
        for at in preparations:
            findings.prepared[at] = results[file_name(preparations[at])]
        later: dict[Place, Sequence[Job]] = {
            at: _cells(arena, each, quick, findings.prepared[at]["policy"]) for at, (arena, each) in waiting.items()
        }
        findings.jobs = len(_unique({**first, **later}))
        results = _work_off(later, store, pool, findings, report, results)
    findings.played = {at: [results[file_name(job)] for job in jobs] for at, jobs in {**ready, **later}.items()}
    return findings


def _places(block: Block, quick: bool) -> Iterator[tuple[Place, Arena, Contestant]]:
    """Who plays where, without those that are missing; nobody where there is no learned policy to compare with."""
    if all(missing_names(each.reference) for each in block.learned):
        return
    for number, row in enumerate(block.rows):
        if not is_playable(row):
            continue
        for place, arena in enumerate(row.arenas):
            shorter = replace(arena, episodes=min(arena.episodes, QUICK_EPISODES)) if quick else arena
            for each in block.contestants:
                if each.name not in row.without and not missing_names(each.reference):
                    yield (block.name, number, place, each.name), shorter, each


def _cells(arena: Arena, each: Contestant, quick: bool, policy: str = "") -> list[Cell]:
    reference = policy or (each.quick_policy if quick and each.quick_policy else each.reference)
    episodes = min(each.episodes, QUICK_EPISODES) if quick else each.episodes
    return arena.cells(reference, each.name, episodes, each.overrides)


def _preparation(arena: Arena, each: Contestant, quick: bool) -> Preparation:
    overrides = {**arena.overrides, **each.overrides}
    return Preparation(
        arena.problem, arena.name, arena.preset, overrides, each.name, each.prepare, quick, arena.opponent
    )


def _unique(jobs: Mapping[Place, Sequence[Job]]) -> dict[str, Job]:
    return {file_name(job): job for group in jobs.values() for job in group}


def _work_off(
    jobs: Mapping[Place, Sequence[Job]],
    store: Store,
    pool: Workers,
    findings: Findings,
    report: Report | None,
    results: dict[str, Result],
) -> dict[str, Result]:
    """`results` by the name of the work, with those of the jobs added; the long ones are begun first."""
    left = [job for name, job in _unique(jobs).items() if name not in results]
    left.sort(key=lambda job: -job.episodes if isinstance(job, Cell) else -np.inf)
    for job, result, known in finish_all(left, store, pool):
        results[file_name(job)] = result
        findings.reused += known
        if report is not None:
            report(len(results), findings.jobs, job.label)
    return results
