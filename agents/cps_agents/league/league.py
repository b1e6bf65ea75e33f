"""The cross-play matrix of a problem: who takes part, what everybody is paid, and the equilibrium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeAlias

from cps_agents.arena.challenge import ALL, Admission, Application, admit, check_known, contestants, usual
from cps_agents.arena.play import Report, silent
from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.league.equilibrium import Equilibrium, dominating, game_value, solve
from cps_agents.league.meetings import RETURN, Payoffs, find_clashes, has_played, left_out_for, play_meetings
from cps_baselines.arena import Contestant, Venue
from cps_baselines.workers import Workers
from cps_envs.core.types import ROLES, SIGN, FloatArray, Role, other

Dominators: TypeAlias = list[FloatArray | None]


@dataclass(frozen=True)
class LeftOut:
    """A policy that does not take part."""

    role: Role
    reference: str
    reason: str


@dataclass(frozen=True)
class LeaguePlan:
    """Who is asked to take part; the evaluation seeds 0, 1, ... are played."""

    venue: Venue
    references: Mapping[Role, Sequence[str]]  # `all` stands for the usual ones
    episodes: int
    metric: str = RETURN
    oracles: bool = False  # whether the usual ones include those that know more than they observe

    @property
    def seeds(self) -> range:
        """The episodes' seeds."""
        return range(self.episodes)

    def wanted(self, role: Role) -> list[str]:
        """The references of a role."""
        known = usual(self.venue, role)
        named = self.references.get(role) or [ALL]
        return list(dict.fromkeys(each for name in named for each in (known if name == ALL else [name])))


@dataclass(frozen=True)
class League:
    """The result of a league: who played, the matrix of payoffs, and what follows from it."""

    plan: LeaguePlan
    attackers: list[Contestant]
    defenders: list[Contestant]
    left_out: list[LeftOut]
    payoffs: Payoffs

    @cached_property
    def cells(self) -> list[list[Estimate]]:
        """Mean and interval of each pair, attackers in rows."""
        return [[estimate([values[None]]) for values in row] for row in self.payoffs.values]

    @cached_property
    def equilibrium(self) -> Equilibrium:
        """Of the means."""
        return solve(self.payoffs.means)

    @cached_property
    def value(self) -> Estimate:
        """Of the game of the true means; without an interval for a single episode."""
        return game_value(self.payoffs.values)

    @cached_property
    def dominated(self) -> dict[Role, Dominators]:
        """By which strategy of its own role each policy is strictly dominated."""
        means = self.payoffs.means
        return {"attacker": dominating(means), "defender": dominating(-means.T)}

    def players(self, role: Role) -> list[Contestant]:
        """Those of a role."""
        return self.attackers if role == "attacker" else self.defenders


def play_league(plan: LeaguePlan, store: Store, workers: int, report: Report = silent) -> League:
    """Play everybody against everybody.

    Policies that cannot play the configuration are left out; so are oracles that nobody asked for by name.

    Raises:
        CommandError: a name that nothing has, or nobody left of a role.
    """
    with Workers(workers) as pool:
        players, left_out = line_up(plan, store, pool)
        for role in ROLES:
            check_anybody(role, players, left_out)
        attackers, defenders = players["attacker"], players["defender"]
        payoffs = play_meetings(
            plan.venue, attackers, defenders, plan.seeds, store=store, pool=pool, metric=plan.metric, report=report
        )
    return League(plan, attackers, defenders, left_out, payoffs)


def line_up(plan: LeaguePlan, store: Store, pool: Workers) -> tuple[dict[Role, list[Contestant]], list[LeftOut]]:
    """Who of those asked can play and meet all others who are left, by role, and who is left out.

    Raises:
        CommandError: a name that nothing has.
    """
    present, left_out = entrants(plan, store, pool)
    gone = left_out_for(find_clashes(plan.venue, present, pool), plan.references)
    left_out += [LeftOut(role, reference, reason) for (role, reference), reason in gone.items()]
    return {role: [each for each in present[role] if (role, each.reference) not in gone] for role in ROLES}, left_out


def entrants(plan: LeaguePlan, store: Store, pool: Workers) -> tuple[dict[Role, list[Contestant]], list[LeftOut]]:
    """Who of those asked can play, by role, and who is left out.

    Raises:
        CommandError: a name that nothing has.
    """
    asked = {role: contestants(plan.venue, plan.wanted(role)) for role in ROLES}
    applications = [
        Application(role, each, has_played(plan.venue, role, each, asked[other(role)], plan.seeds, store))
        for role in ROLES
        for each in asked[role]
    ]
    present: dict[Role, list[Contestant]] = {role: [] for role in ROLES}
    left_out = []
    found = {
        id(application): admission for application, admission in pool.run(partial(admit, plan.venue), applications)
    }
    for application in applications:
        if reason := reason_against(plan, application, found[id(application)]):
            left_out.append(LeftOut(application.role, application.contestant.reference, reason))
        else:
            present[application.role].append(application.contestant)
    return present, left_out


def reason_against(plan: LeaguePlan, application: Application, admission: Admission) -> str:
    """Why an application is left out; empty if it plays."""
    if application.contestant.reference in (plan.references.get(application.role) or ()):  # asked for by its name
        check_known(application, admission)
        return admission.refusal
    return admission.oracle if admission.oracle and not plan.oracles else admission.refusal


def check_anybody(role: Role, players: Mapping[Role, Sequence[Contestant]], left_out: Sequence[LeftOut]) -> None:
    """Whether somebody is left to play a role.

    Raises:
        CommandError: nobody is.
    """
    if not players[role]:
        reasons = "; ".join(f"{found.reference}: {found.reason}" for found in left_out if found.role == role)
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
    players = league.players(role)
    dominating = {} if dominator is None else _named([player.name for player in players], dominator)
    return LeagueStanding(players[place], share, league.players(other(role))[best].name, cells[best], dominating)


def _named(names: Sequence[str], probabilities: FloatArray) -> dict[str, float]:
    return {name: float(share) for name, share in zip(names, probabilities, strict=True) if share > 0}


def strategies(league: League) -> dict[Role, dict[str, float]]:
    """The equilibrium's mixed strategies, by reference; what has probability 0 is left out."""
    found = league.equilibrium
    return {
        "attacker": _named([player.reference for player in league.attackers], found.attacker),
        "defender": _named([player.reference for player in league.defenders], found.defender),
    }
