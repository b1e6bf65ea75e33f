"""Solving (2.9) on the plain law, with kernels only: the genetic algorithm as an experiment of the chapter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_baselines.disbanding.plan_search import Evaluate, SearchResult, SearchSettings, search_plan
from cps_baselines.disbanding.reproduction.scenario import Scenario
from cps_envs.core.kernels import pack
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.dynamics import advance
from cps_envs.disbanding.payoff import measured
from cps_envs.disbanding.start import nominal_constants, place, undisturbed
from cps_envs.disbanding.state import allocate

DEFAULT = SearchSettings()
DISTINCT_PLANS = 0.6  # of the plans that a search looks at; the others it has seen before


@dataclass(frozen=True)
class Search:
    """A seeded search for the plan of `budget` disbandings with the largest E_v over all vehicles, without defence."""

    budget: int
    tau_s: float
    interpretation: str = "S0"
    seed: int = 0
    settings: SearchSettings = DEFAULT

    @property
    def cost(self) -> float:
        """How long it takes, relative to scenarios."""
        plans = self.settings.population * self.settings.generations
        return DISTINCT_PLANS * plans * self.scenario.cost

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"genetic algorithm, K = {self.budget}, tau = {self.tau_s:g} s"

    @property
    def scenario(self) -> Scenario:
        """What is attacked."""
        return Scenario((), tau_s=self.tau_s, interpretation=self.interpretation)

    def run(self) -> SearchResult:
        """Search."""
        config = self.scenario.config
        return search_plan(
            evaluator(self.scenario),
            num_platoons=config.max_platoons,
            budget=self.budget,
            latest_s=int(config.duration_s),
            seed=self.seed,
            settings=self.settings,
        )


def evaluator(scenario: Scenario) -> Evaluate:
    """A function from plans, disbanding times (P, N) of the paper's platoons 1..N, to E_v over all vehicles (P,)."""
    config = scenario.config
    nominal = pack(nominal_constants(config))

    def evaluate(plans: FloatArray) -> FloatArray:
        envs = np.ones(len(plans), np.bool_)
        constants = np.repeat(nominal, len(plans))
        state = allocate(len(plans), config.max_platoons, config.vehicles_per_platoon)
        place(state, constants, undisturbed(constants, config.max_vehicles), envs)
        state.disbanding_s[:] = plans[:, ::-1]
        advance(state, constants, np.zeros_like(state.position), envs, config.horizon_steps)
        errors: FloatArray = measured(state, constants, config.horizon_steps)["velocity_error_all"]
        return errors

    return evaluate
