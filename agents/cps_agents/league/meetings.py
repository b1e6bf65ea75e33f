"""Everybody against everybody: what each pair's episodes paid, from what was played before and what is played now.

Pairs cannot meet where their observation and action forms exclude each other: somebody is left out for it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import TypeAlias

import numpy as np

from cps_agents.arena.meeting import Result
from cps_agents.arena.play import Report, play, silent
from cps_agents.arena.store import Store
from cps_agents.arena.table import Pair, Table, scores
from cps_agents.arena.venue import Venue
from cps_agents.errors import explain
from cps_agents.workers import Workers
from cps_agents.zoo.references import is_trained
from cps_envs import find_problem
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import ROLES, FloatArray, Role

Member: TypeAlias = tuple[Role, str]  # role and reference
LeftOut: TypeAlias = dict[Member, str]  # who does not take part, and why
Clash: TypeAlias = tuple[Member, Member]


def find_clashes(table: Table, pool: Workers) -> dict[Clash, str]:
    """The pairs that cannot meet, and why. Players that see and act in one form can: each was admitted in it."""
    pairs = [
        (attacker, defender)
        for attacker, defender in product(table.attackers, table.defenders)
        if attacker.overrides != defender.overrides
    ]
    return {
        (("attacker", attacker.reference), ("defender", defender.reference)): reason
        for (attacker, defender), reason in pool.run(partial(clash, table.venue), pairs)
        if reason
    }


def clash(venue: Venue, pair: tuple[Contestant, Contestant]) -> str:
    """Why an attacker and a defender cannot meet; empty if they can."""
    problem, (attacker, defender) = find_problem(venue.problem), pair
    try:
        config = problem.config(venue.preset, {**venue.overrides, **attacker.overrides, **defender.overrides})
        game = problem.game(config, 1)
        for role, each in zip(ROLES, pair, strict=True):
            problem.policy(each.reference, game, role)
    except Exception as error:
        reason = explain(error)
        if reason is None:
            raise
        return reason
    return ""


def left_out_for(clashes: Mapping[Clash, str], asked: Mapping[Role, Sequence[str]]) -> LeftOut:
    """The policies to leave out so that all others can meet, and why.

    Those with most clashes go first; of equals, one that nobody asked for by name, and a computed one.
    """
    left, found = dict(clashes), LeftOut()
    while left:
        counts = Counter(member for pair in left for member in pair)
        gone = max(counts, key=lambda each: (counts[each], each[1] not in asked.get(each[0], ()), _computed(each)))
        reasons = {_rival(pair, gone): reason for pair, reason in left.items() if gone in pair}
        found[gone] = f"it cannot meet {' and '.join(reasons)}: {next(iter(reasons.values()))}"
        left = {pair: reason for pair, reason in left.items() if gone not in pair}
    return found


def _computed(member: Member) -> bool:
    return not is_trained(member[1])


def _rival(pair: Clash, member: Member) -> str:
    attacker, defender = pair
    return defender[1] if member == attacker else attacker[1]


@dataclass(frozen=True)
class Payoffs:
    """m attackers against n defenders in E episodes, the same seeds for every pair."""

    values: FloatArray  # (m, n, E)
    cpu_s: FloatArray  # (m, n)
    results: Mapping[Pair, Result]

    @property
    def means(self) -> FloatArray:
        """The matrix (m, n)."""
        found: FloatArray = self.values.mean(axis=2)
        return found


def payoffs_of(table: Table, results: Mapping[Pair, Result]) -> Payoffs:
    """What the table measures, from the results of every pair.

    Raises:
        UnknownNameError: there is no such metric.
    """
    shape = (len(table.attackers), len(table.defenders))
    values = np.array([scores([results[pair]], table.metric)[0] for pair in table.pairs]).reshape(*shape, -1)
    cpu_s = np.array([results[pair]["cpu_s"] for pair in table.pairs]).reshape(shape)
    return Payoffs(values, cpu_s, results)


def play_table(table: Table, store: Store, pool: Workers, report: Report = silent) -> Payoffs:
    """Play what `store` does not have; each finished pair is kept at once.

    Raises:
        UnknownNameError: there is no such metric.
        CommandError: a pair cannot play.
    """
    played = play([table], store, pool, report=report)
    return payoffs_of(table, {place[1:]: result for place, (result,) in played.results.items()})


def has_played(table: Table, role: Role, place: int, store: Store) -> bool:
    """Whether a contestant has finished a meeting before, so that it can play."""
    mine = [pair for pair in table.pairs if pair[ROLES.index(role)] == place]
    for pair in mine:
        with suppress(ConfigurationError):  # one of them cannot play there
            if store.get(table.meeting(pair)) is not None:
                return True
    return False
