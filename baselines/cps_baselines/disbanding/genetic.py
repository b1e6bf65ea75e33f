"""The paper's attacker: an open-loop plan found by a genetic algorithm on the true model before the episode starts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cps_baselines.disbanding.plan_search import Progress, SearchResult, SearchSettings, search_plan
from cps_baselines.disbanding.plans import NEVER, PlannedAttack
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.game.game import Game
from cps_envs.core.game.match import Match
from cps_envs.core.game.play import finish
from cps_envs.core.policies.policy import Policy, RoleSpec
from cps_envs.core.types import FloatArray, Generators, Knowledge, Known, State

OBJECTIVES = {"payoff": None, "all": "velocity_error_all", "intact": "velocity_error_intact"}


class GeneticAlgorithm(PlannedAttack):
    """Searches the best plan (2.9) on copies of the episode's start, with a genetic algorithm, and plays it.

    An oracle: it knows the model with all drawn parameters and the defender it will meet (where that one is played
    inside the same match; else it plans against no defence). Equal episodes are solved once. `reports` holds the
    search results, `objective` is "payoff", "all" or "intact".
    """

    privileged = frozenset({"model", "opponent"})
    from_front = False

    def __init__(
        self,
        spec: RoleSpec,
        *,
        generations: int = SearchSettings.generations,
        population: int = SearchSettings.population,
        objective: str = "payoff",
        progress: Progress | None = None,
    ) -> None:
        super().__init__(spec)
        if objective not in OBJECTIVES:
            raise ConfigurationError(f"objective = {objective!r} is not known. {near(objective, OBJECTIVES)}")
        if progress is not None and not callable(progress):
            raise ConfigurationError(f"progress = {progress!r} must be a function, or left out")
        self.settings = SearchSettings(generations=generations, population=population)
        self.metric = OBJECTIVES[objective]
        self.progress = progress
        self.reports: dict[bytes, SearchResult] = {}

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Search a plan for each episode whose start was not seen before."""
        plans = [self._plan(generator, known) for generator, known in zip(generators, knowledge, strict=True)]
        return (np.stack(plans),)

    def _plan(self, generator: np.random.Generator, known: Known) -> FloatArray:
        model, seed = known["model"], int(generator.integers(2**31))
        start, times = model(1), np.full(self.spec.config.max_platoons, NEVER)
        if start.budget[0] == 0:  # a quiet episode
            return times
        key = start.fingerprint()
        if key not in self.reports:
            config = self.spec.config
            present = start.num_present_platoons(0)
            self.reports[key] = search_plan(
                plan_evaluator(model, known["opponent"], self.metric),
                num_platoons=present,
                budget=int(start.budget[0]),
                latest_s=int(config.duration_s),
                seed=seed,
                settings=self.settings,
                progress=self.progress,
            )
        found = self.reports[key].times
        times[: len(found)] = found
        return times


class GivenPlans(PlannedAttack):
    """Plans (P, N) dealt to the episodes in order."""

    from_front = False

    def __init__(self, spec: RoleSpec, plans: FloatArray) -> None:
        super().__init__(spec)
        self.plans = plans

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The plans as they are; their number is that of the episodes."""
        return (self.plans,)


def plan_evaluator(
    model: Callable[[int], Game], defender: Policy | None, metric: str | None
) -> Callable[[FloatArray], FloatArray]:
    """A function that plays plans (P, N) to the end of the episode and returns the payoff or a metric of each (P,)."""

    def evaluate(plans: FloatArray) -> FloatArray:
        game = model(len(plans))
        width = game.config.max_platoons
        padded = np.pad(plans, ((0, 0), (0, width - plans.shape[1])), constant_values=NEVER)
        players: dict[Any, Policy] = {"attacker": GivenPlans(game.spec("attacker"), padded)}
        if defender is not None:
            players["defender"] = defender
        match = Match(game, players)
        match.begin(np.ones(len(plans), np.bool_), [np.random.default_rng(0) for _ in plans])
        payoff = finish(match)
        return payoff if metric is None else game.metrics()[metric].copy()

    return evaluate
