"""The attacks that a trained policy is measured by: a known suite, and attacks that are searched afresh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cps_agents.arena.challenge import ALL
from cps_agents.arena.store import Store
from cps_agents.league.league import Plan, check_anybody, line_up
from cps_agents.league.meetings import play_meetings
from cps_agents.league.oracles import choose_oracles
from cps_agents.league.response import Budget, Question, Response, respond, silent
from cps_agents.league.strategy import Strategy
from cps_agents.progress import Progress
from cps_agents.zoo.references import FORMS, form_of
from cps_baselines.arena import Contestant, Venue
from cps_baselines.contest import declared_contest
from cps_baselines.workers import Workers
from cps_envs.core.seeds import VALIDATION
from cps_envs.core.types import FloatArray

SOLVERS = ("bnb", "lp_greedy")  # plan for exact sensors, minutes an episode


@dataclass(frozen=True)
class Trial:
    """Where attacks are measured: a configuration, a strategy of the defender, and how much is played."""

    venue: Venue
    strategy: Strategy
    episodes: int  # of each attack against each of the strategy's policies
    budget: Budget  # of the searches together
    store: Store
    title: str  # of the progress bars


@dataclass(frozen=True)
class Attacks:
    """Who attacks whom."""

    known: list[Contestant]
    found: Response  # the best of the searches
    defenders: list[Contestant]  # those of the strategy, in its order

    @property
    def every(self) -> list[Contestant]:
        """The known ones, then the searched one."""
        return [*self.known, Contestant("searched", self.found.reference)]


def gather(trial: Trial) -> Attacks:
    """The attacks of the problem's contest, the registered and the shipped ones, and one searched against the strategy.

    They have to fit the configuration, and to know no more than they observe.

    Raises:
        CommandError: no attack fits, or the searches find nothing.
    """
    problem = trial.venue.problem
    plan = Plan(trial.venue, {"attacker": [*_suite(problem), ALL], "defender": trial.strategy.policies}, trial.episodes)
    with Workers(trial.budget.workers) as pool:
        present, left_out = line_up(plan, trial.store, pool)
        check_anybody("attacker", present, left_out)
    needed = set(FORMS.get((problem, "defender"), ()))  # what no attack may change
    known = [
        attack
        for attack in present["attacker"]
        if attack.reference not in SOLVERS and not set(form_of(attack.reference, trial.venue.config)) & needed
    ]
    question = Question("attacker", trial.strategy, trial.venue, trial.episodes)
    oracles = choose_oracles(problem, "attacker", ["search"])
    found = respond(oracles, question, Path(), trial.budget, trial.store, trial.title, silent).chosen
    return Attacks(known, found, present["defender"])


def paid(trial: Trial, attacks: Sequence[Contestant], defenders: Sequence[Contestant], start: int = 0) -> FloatArray:
    """What attacks are paid, (attacks, defenders, episodes), on the seeds from `start` on: evaluation's if left out."""
    seeds = range(start, start + trial.episodes)
    stage = "evaluation" if start == 0 else "known attacks"
    with Progress(f"{trial.title}, {stage}", 1) as progress, Workers(trial.budget.workers) as pool:
        return play_meetings(
            trial.venue, attacks, defenders, seeds, store=trial.store, pool=pool, report=progress.report
        ).values


def best(trial: Trial, attacks: Attacks) -> list[int]:
    """For each defender the place, in `every`, of the attack that is paid most on validation seeds."""
    means = paid(trial, attacks.every, attacks.defenders, VALIDATION.start).mean(axis=2)
    return [int(place) for place in means.argmax(axis=0)]


def _suite(problem: str) -> list[str]:
    """The attackers of the problem's contest."""
    contest = declared_contest(problem)
    return [] if contest is None else [attack.reference for attack in contest.attackers.policies]
