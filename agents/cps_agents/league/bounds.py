"""By how much each profile of a self-play is exploited, by all policies that were found, early or late."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.league.equilibrium import guaranteed
from cps_agents.league.meetings import Payoffs
from cps_agents.league.self_play import (
    Iteration,
    Pool,
    Profile,
    SelfPlayGame,
    equilibrium_profile,
    play_pool,
)
from cps_agents.league.strategy import Strategy
from cps_agents.workers import Where
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.declare.seeds import EVALUATION, VALIDATION
from cps_envs.core.types import FloatArray


@dataclass(frozen=True)
class Bounds:
    """How far each side of a profile can be exploited, on evaluation seeds.

    Each side's best reply is chosen on validation seeds, among all policies.
    """

    value: Estimate  # what the attacker is paid when both play the profile
    conceded: Estimate  # by the defender's strategy to the best attacker found: at most what it truly concedes
    secured: Estimate  # by the attacker's strategy against the best defender found: at least what it truly secures
    attacker_gain: Estimate  # of the best attacker found against the defender's strategy: conceded minus value
    defender_gain: Estimate  # of the best defender found against the attacker's: value minus secured
    exploitability: (
        Estimate  # of both together: conceded minus secured, paired by episode: at most what the profile's truly is
    )
    game: Estimate  # the value of the game of all policies found, between what both strategies surely guarantee
    at_most: float | None  # the profile's exploitability by the policies found, with 95 % confidence
    best_attacker: str
    best_defender: str


@dataclass(frozen=True)
class LeagueOutcome:
    """The result of self-play after some iterations."""

    game: SelfPlayGame
    pool: Pool
    iterations: Sequence[Iteration]
    bounds: Sequence[Bounds]  # of the iterations' profiles, by all policies
    final: Profile  # the equilibrium of all policies, to which nobody has responded yet
    final_bounds: Bounds

    @property
    def steps(self) -> int:
        """Steps that all oracles took."""
        return sum(found.steps for each in self.iterations for found in each.responses.values())

    @property
    def cpu_s(self) -> float:
        """CPU seconds that all oracles took."""
        return sum(found.cpu_s for each in self.iterations for found in each.responses.values())


def judge(
    game: SelfPlayGame, pool: Pool, iterations: Sequence[Iteration], store: Store, workers: Where
) -> LeagueOutcome:
    """Play what is missing in the matrices of all policies, and bound every profile by them."""
    validation, evaluation = (play_pool(game, pool, seeds, store, workers) for seeds in (VALIDATION, EVALUATION))
    final = equilibrium_profile(pool, validation.means)
    profiles = [*(iteration.profile for iteration in iterations), final]
    bounds = [bounds_of(profile, pool, validation, evaluation) for profile in profiles]
    return LeagueOutcome(game, pool, list(iterations), bounds[:-1], final, bounds[-1])


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
        attacker_gain=_estimate(conceded - met),
        defender_gain=_estimate(met - secured),
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
