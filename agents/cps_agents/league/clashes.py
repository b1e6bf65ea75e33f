"""Pairs that cannot meet, as their observation and action forms exclude each other, and who is left out for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TypeAlias

from cps_agents.errors import explain
from cps_agents.zoo.references import is_trained
from cps_baselines.arena import Contestant, Venue
from cps_baselines.workers import Workers
from cps_envs import find_problem
from cps_envs.core.types import ROLES, Role

Member: TypeAlias = tuple[Role, str]  # role and reference
Pair: TypeAlias = tuple[Member, Member]


def find_clashes(venue: Venue, players: Mapping[Role, Sequence[Contestant]], pool: Workers) -> dict[Pair, str]:
    """Who cannot meet, and why; players that see and act in one form can, as each of them was admitted in it."""
    pairs = [
        (attacker, defender)
        for attacker in players["attacker"]
        for defender in players["defender"]
        if attacker.overrides != defender.overrides
    ]
    return {
        (("attacker", attacker.reference), ("defender", defender.reference)): reason
        for (attacker, defender), reason in pool.run(partial(clash, venue), pairs)
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


def left_out_for(clashes: Mapping[Pair, str], asked: Mapping[Role, Sequence[str]]) -> dict[Member, str]:
    """Whom to leave out so that all others can meet, and why.

    Those with most clashes go first; of equals, one that nobody asked for by name, and a computed one.
    """
    left, found = dict(clashes), dict[Member, str]()
    while left:
        counts = Counter(member for pair in left for member in pair)
        gone = max(counts, key=lambda each: (counts[each], each[1] not in asked.get(each[0], ()), _computed(each)))
        reasons = {_rival(pair, gone): reason for pair, reason in left.items() if gone in pair}
        found[gone] = f"it cannot meet {' and '.join(reasons)}: {next(iter(reasons.values()))}"
        left = {pair: reason for pair, reason in left.items() if gone not in pair}
    return found


def _computed(member: Member) -> bool:
    return not is_trained(member[1])


def _rival(pair: Pair, member: Member) -> str:
    attacker, defender = pair
    return defender[1] if member == attacker else attacker[1]
