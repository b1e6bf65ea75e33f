"""Playing what blocks ask for: all meetings that the store does not have, once each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TypeAlias

from cps_agents.arena.challenge import Challenge
from cps_agents.arena.play import QUICK_EPISODES, Pairing, Played, Report, play, silent
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.results.block import Block, Row, completed, derived
from cps_agents.zoo.references import missing_names
from cps_baselines.arena import Contestant
from cps_baselines.workers import Workers
from cps_envs import PROBLEMS
from cps_envs.core.errors import near

Place = tuple[str, int, int, str]  # block, row, challenge, contestant
Findings: TypeAlias = Played[Place]


def find_blocks(
    problems: Sequence[str] = tuple(PROBLEMS), names: Sequence[str] = (), policies: Sequence[str] = ()
) -> list[Block]:
    """The blocks of problems, completed; all if nothing is named.

    Problems declare them in `cps_agents.results.<problem>`; `policies` are trained policies that get one of their own.

    Raises:
        CommandError: there is no such block, or nothing to examine.
    """
    known = {block.name: block for problem in problems for block in (*_declared(problem), *derived(problem, policies))}
    for name in names:
        if name not in known:
            raise CommandError(f"there is no table {name!r} of learned policies. {near(name, known)}")
    if not known:
        raise CommandError(
            f"no trained policy of {', '.join(problems)} comes with the package: name yours with --policy zoo:FOLDER"
        )
    return [completed(block) for name, block in known.items() if not names or name in names]


def _declared(problem: str) -> tuple[Block, ...]:
    if problem not in PROBLEMS:
        return ()
    found: tuple[Block, ...] = import_module(f"cps_agents.results.{problem}").BLOCKS
    return found


def declared_blocks() -> dict[str, list[str]]:
    """The names of the blocks of each problem."""
    return {name: [block.name for block in _declared(name)] for name in PROBLEMS}


def missing_of(block: Block) -> dict[str, list[str]]:
    """The contestants, and `opponents`, whose trained policies are not there."""
    found = {each.name: missing_names(each.reference) for each in block.contestants}
    opponents = [challenge.opponent for row in block.rows for challenge in row.challenges]
    found["opponents"] = list(dict.fromkeys(name for opponent in opponents for name in missing_names(opponent)))
    return {name: names for name, names in found.items() if names}


def is_playable(row: Row) -> bool:
    """Whether all opponents of a row are there."""
    return not any(missing_names(challenge.opponent) for challenge in row.challenges)


def examine(
    blocks: Sequence[Block], store: Store, *, workers: int, quick: bool = False, report: Report = silent
) -> Findings:
    """Play everything that `store` does not have yet, keeping each result as soon as it is there."""
    with Workers(workers) as pool:
        pairings = {place: pairing for block in blocks for place, pairing in _places(block, quick)}
        return play(pairings, store, pool, quick=quick, report=report)


def _places(block: Block, quick: bool) -> Iterator[tuple[Place, Pairing]]:
    """Who plays where, without those that are missing; nobody where there is no learned policy to compare with."""
    if all(missing_names(each.reference) for each in block.learned):
        return
    for number, row in enumerate(block.rows):
        if not is_playable(row):
            continue
        for place, challenge in enumerate(row.challenges):
            for each in block.contestants:
                if each.name not in row.without and not missing_names(each.reference):
                    yield (block.name, number, place, each.name), pairing(challenge, each, quick)


def pairing(challenge: Challenge, each: Contestant, quick: bool) -> Pairing:
    """A contestant in a challenge, in few episodes if it is to be quick."""
    if not quick:
        return challenge.pairing(each, each.episodes)
    shorter = replace(each, policy=each.quick_policy) if each.quick_policy else each
    return challenge.pairing(shorter, min(each.episodes or challenge.episodes, QUICK_EPISODES))


def together(found: Sequence[Findings]) -> Findings:
    """The findings of several problems as one."""
    every: Findings = Played()
    for each in found:
        every.results |= each.results
        every.prepared |= each.prepared
        every.reused += each.reused
        every.jobs += each.jobs
    return every
