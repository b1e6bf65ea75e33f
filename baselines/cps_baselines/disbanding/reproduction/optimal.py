"""The genetic algorithm beside the attacks that the paper found with its own."""

from __future__ import annotations

from dataclasses import dataclass

from cps_baselines.disbanding.plan_search import SearchResult
from cps_baselines.disbanding.reproduction.claims_2_3 import best_second, second_error
from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.disbanding.reproduction.experiments import ATTACK_S, ATTACKS, BUDGETS, TAUS_S
from cps_baselines.reproduction.evidence import NotRunError
from cps_baselines.reproduction.verdicts import NOT, of_cases, of_number

Events = list[tuple[int, float]]


@dataclass(frozen=True)
class Optimum:
    """The best attack found with a budget at a tau; errors in percent over all vehicles."""

    budget: int
    tau_s: float
    found: SearchResult
    paper_error: float  # of the paper's plan under our model
    grid: Events  # best of a grid; empty where none was computed
    grid_error: float | None

    @property
    def events(self) -> Events:
        """The plan that the search found."""
        return [(platoon, float(second)) for platoon, second in self.found.events]

    @property
    def best(self) -> tuple[str, float]:
        """Where the largest error known comes from, first of equals, and it."""
        known = {"paper": self.paper_error, "GA": self.found.value}
        if self.grid_error is not None:
            known["grid"] = self.grid_error
        source = max(known, key=lambda name: round(known[name], 6))
        return source, known[source]

    @property
    def verdict(self) -> str:
        """Whether the search finds the paper's plan: its platoons, and the second within the rule for numbers."""
        platoons, seconds = zip(*self.events, strict=True)
        if self.budget == 1:
            return of_cases([platoons == (10,) and seconds == (1.0,)])
        platoon, second = ATTACKS["2.3"][1]
        return of_number(seconds[1], second) if platoons == (10, platoon) else NOT


def optima(evidence: Evidence) -> list[Optimum]:
    """Every search that was run."""
    found = []
    for budget in BUDGETS:
        for tau_s in TAUS_S:
            try:
                result = evidence[evidence.experiments.search(budget, tau_s)]
            except NotRunError:
                continue
            paper_error = evidence[evidence.experiments.paper_plan(budget, tau_s)].velocity_error_all
            grid, grid_error = _grid(evidence, tau_s) if budget == 2 else ([], None)
            found.append(Optimum(budget, tau_s, result, paper_error, grid, grid_error))
    return found


def _grid(evidence: Evidence, tau_s: float) -> tuple[Events, float | None]:
    try:
        plan = best_second(evidence, tau_s)
    except NotRunError:
        return [], None
    return [(10, ATTACK_S), plan], second_error(evidence, tau_s, *plan)
