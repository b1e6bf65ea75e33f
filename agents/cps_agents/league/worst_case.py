"""What the worst attack found costs a trained defender: a known suite, and attacks searched afresh against it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.league.attacks import Trial, best, gather, paid
from cps_agents.league.response import Budget
from cps_agents.league.strategy import mix
from cps_agents.zoo.card import Card
from cps_baselines.arena import Venue
from cps_envs.registration import find_problem


@dataclass(frozen=True)
class WorstCase:
    """What a card says of a defender; a bound from below, since a longer search may find more."""

    attack: str  # reference of the attack that validation seeds choose as the worst
    pay: Estimate  # what it is paid on evaluation seeds
    unit: str
    attacks: int  # known ones that played
    searched: str  # the best of the searches
    searched_pay: Estimate
    budget_s: float  # CPU time of all searches together
    training_seed: int  # of the defender
    command: str

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def worst_case(card: Card, reference: str, budget: Budget, episodes: int, store: Store) -> WorstCase:
    """Play the known attacks and the searched ones against a defender in the configuration that it was trained in.

    Raises:
        CommandError: it is no defender, or no attack fits.
    """
    if card.role != "defender":
        raise CommandError(f"{card.name} is an attacker: only defenders are judged by the worst attack against them")
    venue = Venue(card.problem, card.preset, dict(card.overrides))
    trial = Trial(venue, mix([reference]), episodes, budget, store, card.name)
    attacks = gather(trial)
    (worst,) = best(trial, attacks)
    judged = [attacks.every[worst], attacks.every[-1]]
    pay, searched_pay = (estimate([row]) for row in paid(trial, judged, attacks.defenders))
    return WorstCase(
        attack=judged[0].reference,
        pay=pay,
        unit=find_problem(card.problem).unit or "return",
        attacks=len(attacks.known),
        searched=attacks.found.reference,
        searched_pay=searched_pay,
        budget_s=0.0 if budget.cpu_s is None else budget.cpu_s,
        training_seed=card.best,
        command=budget.command,
    )
