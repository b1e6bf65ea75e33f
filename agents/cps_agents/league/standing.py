"""How each policy of a league stands: its share of the equilibrium, its best opponent, what dominates it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cps_agents.arena.statistics import Estimate
from cps_agents.league.league import League
from cps_baselines.arena import Contestant
from cps_envs.core.types import SIGN, FloatArray, Role, other


@dataclass(frozen=True)
class Standing:
    """A policy among those of its role."""

    player: Contestant
    probability: float  # in the equilibrium
    best_opponent: str  # against it
    payoff: Estimate  # what the attacker is paid then: the least an attacker gets, the most a defender concedes
    dominated_by: dict[str, float]  # a strategy that is better against everybody; empty if there is none


def standings(league: League, role: Role) -> list[Standing]:
    """The policies of a role, in the league's order."""
    equilibrium = league.equilibrium
    shares = equilibrium.attacker if role == "attacker" else equilibrium.defender
    return [
        _standing(league, role, place, float(shares[place]), dominator)
        for place, dominator in enumerate(league.dominated[role])
    ]


def _standing(league: League, role: Role, place: int, share: float, dominator: FloatArray | None) -> Standing:
    cells = league.cells[place] if role == "attacker" else [row[place] for row in league.cells]
    best = min(range(len(cells)), key=lambda rival: SIGN[role] * cells[rival].mean)
    players = league.players(role)
    dominating = {} if dominator is None else _named([player.name for player in players], dominator)
    return Standing(players[place], share, league.players(other(role))[best].name, cells[best], dominating)


def _named(names: Sequence[str], probabilities: FloatArray) -> dict[str, float]:
    return {name: float(share) for name, share in zip(names, probabilities, strict=True) if share > 0}


def strategies(league: League) -> dict[Role, dict[str, float]]:
    """The equilibrium's mixed strategies, by reference; what has probability 0 is left out."""
    found = league.equilibrium
    return {
        "attacker": _named([player.reference for player in league.attackers], found.attacker),
        "defender": _named([player.reference for player in league.defenders], found.defender),
    }
