"""What the worst attack found costs: of a trained defender, and of each profile of a self-play.

A trained defender meets a known suite, and attacks searched afresh against it. A profile of a self-play is exploited by
all policies that were found, early or late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.arena.challenge import ALL
from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.contest.contest import declared_contest
from cps_agents.errors import CommandError
from cps_agents.league.equilibrium import guaranteed
from cps_agents.league.league import Plan, check_anybody, line_up
from cps_agents.league.meetings import Payoffs, play_meetings
from cps_agents.league.oracles import choose_oracles
from cps_agents.league.response import Budget, Question, Response, respond, silent
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
from cps_agents.learning.seeds import VALIDATION
from cps_agents.progress import Progress
from cps_agents.zoo.card import Card
from cps_agents.zoo.references import FORMS, form_of
from cps_baselines.arena import Contestant, Venue
from cps_baselines.workers import Workers
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


SOLVERS = ("bnb", "lp_greedy")  # plan for exact sensors, minutes an episode


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

    Known are those of the problem's contest, the registered ones and the shipped ones, as far as they fit and know no
    more than they observe.

    Raises:
        CommandError: it is no defender, or no attack fits.
    """
    if card.role != "defender":
        raise CommandError(f"{card.name} is an attacker: only defenders are judged by the worst attack against them")
    venue = Venue(card.problem, card.preset, dict(card.overrides))
    plan = Plan(venue, {"attacker": [*_suite(card.problem), ALL], "defender": [reference]}, episodes)
    with Workers(budget.workers) as pool:
        present, left_out = line_up(plan, store, pool)
        check_anybody("attacker", present, left_out)
    needed = FORMS.get((card.problem, "defender"), ())  # what no attack may change
    known = [
        attack
        for attack in present["attacker"]
        if attack.reference not in SOLVERS and not set(form_of(attack.reference, venue.config)) & set(needed)
    ]
    question = Question("attacker", mix([reference]), venue, episodes)
    oracles = choose_oracles(card.problem, "attacker", ["search"])
    found = respond(oracles, question, Path(), budget, store, card.name, silent).chosen
    attacks = [*known, Contestant("searched", found.reference)]
    worst = _worst(venue, attacks, present["defender"], episodes, store, budget.workers)
    judged = [attacks[worst], attacks[-1]]
    with Progress(f"{card.name}, evaluation", 1) as progress, Workers(budget.workers) as pool:
        values = play_meetings(
            venue, judged, present["defender"], plan.seeds, store=store, pool=pool, report=progress.report
        ).values
    return _summary(card, judged[0], found, [estimate([row]) for row in values], len(attacks) - 1, budget)


def _suite(problem: str) -> list[str]:
    """The attackers of the problem's contest."""
    contest = declared_contest(problem)
    return [] if contest is None else [attack.reference for attack in contest.attackers.policies]


def _worst(
    venue: Venue, attacks: list[Contestant], defenders: list[Contestant], episodes: int, store: Store, workers: int
) -> int:
    """The place of the attack that is paid most on validation seeds."""
    seeds = range(VALIDATION.start, VALIDATION.start + episodes)
    with Progress("known attacks", 1) as progress, Workers(workers) as pool:
        means = play_meetings(venue, attacks, defenders, seeds, store=store, pool=pool, report=progress.report).means
    return int(means[:, 0].argmax())


def _summary(
    card: Card, worst: Contestant, found: Response, paid: list[Estimate], attacks: int, budget: Budget
) -> WorstCase:
    return WorstCase(
        attack=worst.reference,
        pay=paid[0],
        unit=find_problem(card.problem).unit or "return",
        attacks=attacks,
        searched=found.reference,
        searched_pay=paid[1],
        budget_s=0.0 if budget.cpu_s is None else budget.cpu_s,
        training_seed=card.best,
        command=budget.command,
    )
