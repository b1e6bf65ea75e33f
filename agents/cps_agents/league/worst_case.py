"""What the worst attack found costs: of a trained defender, and of each profile of a self-play.

A trained defender meets a known suite, and attacks searched afresh against it. A profile of a self-play is exploited by
all policies that were found, early or late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.league.attacks import Trial, best, gather, paid
from cps_agents.league.equilibrium import guaranteed
from cps_agents.league.meetings import Payoffs
from cps_agents.league.response import Budget
from cps_agents.league.self_play import (
    Game,
    Iteration,
    Pool,
    Profile,
    equilibrium_profile,
    play_evaluation,
    play_validation,
)
from cps_agents.league.strategy import Strategy, mix
from cps_agents.zoo.card import Card
from cps_baselines.arena import Contestant, Venue
from cps_envs.core.types import FloatArray
from cps_envs.registration import find_problem


@dataclass(frozen=True)
class Bounds:
    """Of one profile, on evaluation seeds; each side's best reply is chosen on validation seeds among all policies."""

    value: Estimate  # what the attacker is paid when both play the profile
    conceded: Estimate  # by the defender's strategy to the best attacker found: at most what it truly concedes
    secured: Estimate  # by the attacker's strategy against the best defender found: at least what it truly secures
    exploitability: Estimate  # conceded minus secured, paired by episode: at most what the profile's truly is
    game: Estimate  # the value of the game of all policies found, between what both strategies surely guarantee
    at_most: float | None  # the profile's exploitability by the policies found, with 95 % confidence
    best_attacker: str
    best_defender: str


@dataclass(frozen=True)
class Outcome:
    """What there is after some iterations."""

    game: Game
    pool: Pool
    iterations: Sequence[Iteration]
    bounds: Sequence[Bounds]  # of the iterations' profiles, by all policies
    final: Profile  # the equilibrium of all policies, to which nobody has responded yet
    final_bounds: Bounds

    @property
    def steps(self) -> int:
        """Of all oracles."""
        return sum(found.steps for each in self.iterations for found in each.responses.values())

    @property
    def cpu_s(self) -> float:
        """Of all oracles."""
        return sum(found.cpu_s for each in self.iterations for found in each.responses.values())


def judge(game: Game, pool: Pool, iterations: Sequence[Iteration], store: Store, workers: int) -> Outcome:
    """Play what is missing in the matrices of all policies, and bound every profile by them."""
    validation = play_validation(game, pool, store, workers)
    evaluation = play_evaluation(game, pool, store, workers)
    final = equilibrium_profile(pool, validation.means)
    profiles = [*(iteration.profile for iteration in iterations), final]
    bounds = [bounds_of(profile, pool, validation, evaluation) for profile in profiles]
    return Outcome(game, pool, list(iterations), bounds[:-1], final, bounds[-1])


def bounds_of(profile: Profile, pool: Pool, validation: Payoffs, evaluation: Payoffs) -> Bounds:
    """The bounds of a profile whose policies are in the pool, from the pool's matrices."""
    attacking = shares(profile["attacker"], pool["attacker"])
    defending = shares(profile["defender"], pool["defender"])
    row = int((validation.means @ defending).argmax())
    column = int((attacking @ validation.means).argmin())
    values = evaluation.values
    conceded = np.einsum("ne,n->e", values[row], defending)
    secured = np.einsum("me,m->e", values[:, column], attacking)
    met = np.einsum("mne,m,n->e", values, attacking, defending)
    game = guaranteed(np.einsum("mne,m->ne", values, attacking), np.einsum("mne,n->me", values, defending), met)
    return Bounds(
        value=_estimate(met),
        conceded=_estimate(conceded),
        secured=_estimate(secured),
        exploitability=_estimate(conceded - secured),
        game=game,
        at_most=None if game.low is None or game.high is None else game.high - game.low,
        best_attacker=pool["attacker"][row].name,
        best_defender=pool["defender"][column].name,
    )


def shares(strategy: Strategy, players: Sequence[Contestant]) -> FloatArray:
    """A strategy as probabilities of all players."""
    known = dict(zip(strategy.policies, strategy.probabilities, strict=True))
    return np.array([known.get(player.reference, 0.0) for player in players])


def _estimate(values: FloatArray) -> Estimate:
    return estimate([values[np.newaxis]])


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
