"""The cross-play matrix of a problem: who takes part, what everybody is paid, and the equilibrium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TypeAlias

from cps_agents.arena.admission import Admission, admit, check_known, contestants, wanted
from cps_agents.arena.play import Report, silent
from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.arena.table import RETURN, Table
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_agents.league.equilibrium import Equilibrium, dominating, game_value, solve
from cps_agents.league.meetings import LeftOut, Payoffs, find_clashes, has_played, left_out_for, play_table
from cps_agents.workers import Where, Workers
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.types import ROLES, SIGN, FloatArray, Role, other

Dominators: TypeAlias = list[FloatArray | None]


def asked(venue: Venue, references: Mapping[Role, Sequence[str]], episodes: int, metric: str = RETURN) -> Table:
    """A table of all who are asked to take part; `all`, or no name, stands for the usual ones."""
    attackers, defenders = (contestants(venue, wanted(venue, role, references.get(role))) for role in ROLES)
    return Table(venue, attackers, defenders, episodes, metric)


@dataclass(frozen=True)
class League:
    """A table in which everybody has met everybody: who played, the matrix of payoffs, and what follows from it."""

    table: Table
    left_out: LeftOut
    payoffs: Payoffs

    @cached_property
    def cells(self) -> list[list[Estimate]]:
        """Mean and interval of each pair, attackers in rows."""
        return [[estimate([values[None]]) for values in row] for row in self.payoffs.values]

    @cached_property
    def equilibrium(self) -> Equilibrium:
        """The equilibrium of the mean payoffs."""
        return solve(self.payoffs.means)

    @cached_property
    def value(self) -> Estimate:
        """The value of the game of the true means; without an interval for a single episode."""
        return game_value(self.payoffs.values)

    @cached_property
    def dominated(self) -> dict[Role, Dominators]:
        """For each policy the strategy of its own role that strictly dominates it, where there is one."""
        means = self.payoffs.means
        return {"attacker": dominating(means), "defender": dominating(-means.T)}


def play_league(
    table: Table,
    references: Mapping[Role, Sequence[str]],
    store: Store,
    workers: Where,
    report: Report = silent,
    *,
    oracles: bool = False,
) -> League:
    """Play everybody against everybody who can play; see `line_up`.

    Raises:
        CommandError: a name that nothing has, or nobody left of a role.
        UnknownNameError: there is no such metric.
    """
    with Workers(workers) as pool:
        present, left_out = line_up(table, references, store, pool, oracles=oracles)
        check_anybody(present, left_out)
        return League(present, left_out, play_table(present, store, pool, report))


def line_up(
    table: Table,
    references: Mapping[Role, Sequence[str]],
    store: Store,
    pool: Workers,
    *,
    oracles: bool = False,
    together: bool = True,
) -> tuple[Table, LeftOut]:
    """The table with those who can play and, if `together`, meet all others who are left; and who is left out, and why.

    Oracles, which know more than they observe, are left out unless `references` name them or all `oracles` play.

    Raises:
        CommandError: `references` name what nothing has.
    """
    applications = [
        (role, each, has_played(table, role, place, store))
        for role in ROLES
        for place, each in enumerate(table.players(role))
    ]
    admissions = {
        (role, each.reference): admission
        for (role, each, _), admission in pool.run(partial(_admit, table.venue), applications)
    }
    left_out: LeftOut = {}
    for role, each, _ in applications:
        member = role, each.reference
        if each.reference in references.get(role, ()):  # asked for by its name
            check_known(*member, admissions[member])
            reason = admissions[member].refusal
        else:
            reason = (not oracles and admissions[member].oracle) or admissions[member].refusal
        if reason:
            left_out[member] = reason
    present = without(table, left_out)
    clashing = left_out_for(find_clashes(present, pool), references) if together else {}
    return without(present, clashing), left_out | clashing


def _admit(venue: Venue, application: tuple[Role, Contestant, bool]) -> Admission:
    role, contestant, before = application
    return admit(venue, role, contestant, has_played=before)


def without(table: Table, left_out: LeftOut) -> Table:
    """The table of the others."""
    attackers, defenders = (
        [each for each in table.players(role) if (role, each.reference) not in left_out] for role in ROLES
    )
    return replace(table, attackers=attackers, defenders=defenders)


def check_anybody(table: Table, left_out: LeftOut) -> None:
    """Whether somebody is left to play each role.

    Raises:
        CommandError: nobody is.
    """
    for role in ROLES:
        if not table.players(role):
            reasons = "; ".join(f"{name}: {reason}" for (mine, name), reason in left_out.items() if mine == role)
            raise CommandError(f"no {role} can play this configuration. {reasons}")


@dataclass(frozen=True)
class LeagueStanding:
    """How a policy stands among those of its role."""

    player: Contestant
    probability: float  # in the equilibrium
    best_opponent: str  # against it
    payoff: Estimate  # what the attacker is paid then: the least an attacker gets, the most a defender concedes
    dominated_by: dict[str, float]  # a strategy that is better against everybody; empty if there is none


def standings(league: League, role: Role) -> list[LeagueStanding]:
    """The policies of a role, in the league's order."""
    equilibrium = league.equilibrium
    shares = equilibrium.attacker if role == "attacker" else equilibrium.defender
    return [
        _standing(league, role, place, float(shares[place]), dominator)
        for place, dominator in enumerate(league.dominated[role])
    ]


def _standing(league: League, role: Role, place: int, share: float, dominator: FloatArray | None) -> LeagueStanding:
    cells = league.cells[place] if role == "attacker" else [row[place] for row in league.cells]
    best = min(range(len(cells)), key=lambda rival: SIGN[role] * cells[rival].mean)
    players = league.table.players(role)
    dominating = {} if dominator is None else _named([player.name for player in players], dominator)
    return LeagueStanding(players[place], share, league.table.players(other(role))[best].name, cells[best], dominating)


def _named(names: Sequence[str], probabilities: FloatArray) -> dict[str, float]:
    return {name: float(share) for name, share in zip(names, probabilities, strict=True) if share > 0}


def strategies(league: League) -> dict[Role, dict[str, float]]:
    """The equilibrium's mixed strategies, by reference; what has probability 0 is left out."""
    found = league.equilibrium
    return {
        "attacker": _named([player.reference for player in league.table.attackers], found.attacker),
        "defender": _named([player.reference for player in league.table.defenders], found.defender),
    }
