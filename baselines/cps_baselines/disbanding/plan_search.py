"""The genetic algorithm for (2.9): which platoons to disband, and when, so that the damage is largest.

The paper names MATLAB's toolbox and no settings; the settings here are chosen. pymoo runs the generations, this module
gives it what a plan is: K distinct pairs (platoon, whole second), kept front platoon first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.crossover import Crossover
from pymoo.core.mutation import Mutation
from pymoo.core.problem import Problem
from pymoo.core.repair import Repair
from pymoo.core.sampling import Sampling
from pymoo.core.survival import Survival
from pymoo.operators.selection.tournament import TournamentSelection

from cps_baselines.disbanding.plans import NEVER
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array, FloatArray, IntArray

Evaluate = Callable[[FloatArray], FloatArray]  # disbanding times (P, N) -> values (P,)
Progress = Callable[[int, int, float], None]  # generation, generations, best value


@dataclass(frozen=True)
class SearchSettings:
    """The settings of the genetic algorithm; all chosen."""

    population: int = 30
    generations: int = 20
    elites: int = 2
    tournament: int = 3
    crossover: float = 0.8  # probability that two plans exchange pairs
    platoon_mutation: float = 0.15  # per pair
    time_mutation: float = 0.3  # per pair
    time_redraw: float = 0.3  # share of the time mutations that draw uniformly; the others move by
    time_step_s: float = 10.0  # a normal step of this deviation

    def __post_init__(self) -> None:
        if self.generations < 1:
            raise ConfigurationError(f"generations = {self.generations} must be 1 or more")
        if self.population <= self.elites:
            raise ConfigurationError(f"population = {self.population} must be above the {self.elites} that are kept")


@dataclass
class SearchResult:
    """The best plan found and what finding it took."""

    times: FloatArray  # (N,) s, +inf where a platoon is left alone; row i - 1 is the paper's platoon i
    value: float  # the objective, in its unit
    evaluations: int  # plans looked at
    simulations: int  # distinct plans simulated
    history: list[float] = field(default_factory=list)  # best value by generation

    @property
    def events(self) -> list[tuple[int, int]]:
        """The plan as (platoon, second), front platoon first."""
        return [(int(row) + 1, int(self.times[row])) for row in np.flatnonzero(np.isfinite(self.times))[::-1]]


def search_plan(
    evaluate: Evaluate,
    *,
    num_platoons: int,
    budget: int,
    latest_s: int,
    seed: int,
    settings: SearchSettings | None = None,
    progress: Progress | None = None,
) -> SearchResult:
    """Search the plans of `budget` disbandings within 1..latest_s seconds for the one that maximises `evaluate`."""
    settings = settings or SearchSettings()
    problem = PlanProblem(evaluate, num_platoons, budget, latest_s)
    algorithm = GA(
        pop_size=settings.population,
        n_offsprings=settings.population - settings.elites,
        sampling=RandomPlans(),
        selection=TournamentSelection(func_comp=_fittest, pressure=settings.tournament),
        crossover=ExchangePairs(prob=settings.crossover),
        mutation=MovePairs(settings),
        repair=DistinctPlatoons(),
        survival=Elitism(settings.elites),
        eliminate_duplicates=False,
    )
    algorithm.setup(problem, seed=seed, termination=("n_gen", settings.generations), verbose=False)
    result = SearchResult(np.full(num_platoons, NEVER), -np.inf, 0, 0)
    while algorithm.has_next():
        algorithm.next()
        best = algorithm.opt[0]
        result.value, result.times = float(-best.F[0]), problem.times(best.X[np.newaxis])[0]
        result.history.append(result.value)
        if progress is not None:
            progress(len(result.history), settings.generations, result.value)
    result.evaluations, result.simulations = algorithm.evaluator.n_eval, len(problem.memo)
    return result


class PlanProblem(Problem):
    """K pairs as 2K whole numbers: platoons, then seconds. Every distinct plan is evaluated once."""

    def __init__(self, evaluate: Evaluate, num_platoons: int, budget: int, latest_s: int) -> None:
        low = np.ones(2 * budget, dtype=int)
        high = np.repeat([num_platoons, latest_s], budget)
        super().__init__(n_var=2 * budget, n_obj=1, xl=low, xu=high, vtype=int)
        self.evaluate_plans, self.budget = evaluate, budget
        self.num_platoons, self.latest_s = num_platoons, latest_s
        self.memo: dict[bytes, float] = {}

    def times(self, plans: IntArray) -> FloatArray:
        """Disbanding times (P, N) of plans (P, 2K)."""
        times = np.full((len(plans), self.num_platoons), NEVER)
        np.put_along_axis(times, plans[:, : self.budget] - 1, plans[:, self.budget :].astype(float), axis=1)
        return times

    def _evaluate(self, plans: IntArray, out: dict[str, Array], *args: object, **kwargs: object) -> None:
        plans = plans.astype(int)
        keys = [plan.tobytes() for plan in plans]
        fresh = {key: plan for key, plan in zip(keys, plans, strict=True) if key not in self.memo}
        if fresh:
            values = self.evaluate_plans(self.times(np.array(list(fresh.values()))))
            self.memo.update(zip(fresh, values.tolist(), strict=True))
        out["F"] = np.array([[-self.memo[key]] for key in keys])


class RandomPlans(Sampling):
    """Draws the first plans: distinct platoons, seconds uniformly."""

    def _do(self, problem, n_samples, *args, random_state=None, **kwargs):  # type: ignore[no-untyped-def]
        platoons = np.argsort(random_state.random((n_samples, problem.num_platoons)), axis=1)[:, : problem.budget] + 1
        seconds = random_state.integers(1, problem.latest_s + 1, (n_samples, problem.budget))
        return _sorted(np.hstack([platoons, seconds]))


class ExchangePairs(Crossover):
    """Crosses two parents into one child: each (platoon, second) pair comes from either."""

    def __init__(self, prob: float) -> None:
        super().__init__(n_parents=2, n_offsprings=1, prob=prob)

    def _do(self, problem, X, *args, random_state=None, **kwargs):  # type: ignore[no-untyped-def]
        first = np.tile(random_state.random((X.shape[1], problem.budget)) < 0.5, 2)
        return np.where(first, X[0], X[1])[np.newaxis]


class MovePairs(Mutation):
    """Redraws platoons, and redraws or shifts seconds, pair by pair."""

    def __init__(self, settings: SearchSettings) -> None:
        super().__init__(prob=1.0)
        self.settings = settings

    def _do(self, problem, X, *args, random_state=None, **kwargs):  # type: ignore[no-untyped-def]
        knobs, shape = self.settings, (len(X), problem.budget)
        platoons, seconds = np.hsplit(X, 2)
        redraw = random_state.random(shape) < knobs.platoon_mutation
        platoons = np.where(redraw, random_state.integers(1, problem.num_platoons + 1, shape), platoons)
        uniform = random_state.integers(1, problem.latest_s + 1, shape)
        shifted = seconds + np.round(random_state.normal(0.0, knobs.time_step_s, shape)).astype(int)
        moved = np.where(random_state.random(shape) < knobs.time_redraw, uniform, np.clip(shifted, 1, problem.latest_s))
        seconds = np.where(random_state.random(shape) < knobs.time_mutation, moved, seconds)
        return np.hstack([platoons, seconds])


class DistinctPlatoons(Repair):
    """Replaces a platoon that a plan names again by a free one, and puts the front platoon first."""

    def _do(self, problem, X, random_state=None, **kwargs):  # type: ignore[no-untyped-def]
        platoons = X[:, : problem.budget]
        for plan in platoons:
            for place in range(1, problem.budget):
                if plan[place] in plan[:place]:
                    plan[place] = random_state.choice(np.setdiff1d(np.arange(1, problem.num_platoons + 1), plan))
        return _sorted(X)


class Elitism(Survival):
    """The next generation: the children and the best few parents."""

    def __init__(self, elites: int) -> None:
        super().__init__(filter_infeasible=False)
        self.elites = elites

    def _do(self, problem, pop, *args, n_survive=None, **kwargs):  # type: ignore[no-untyped-def]
        parents = len(pop) - (n_survive - self.elites)
        ranked = np.argsort(pop[:parents].get("F")[:, 0], kind="stable")
        return pop[np.concatenate([ranked[: self.elites], np.arange(parents, len(pop))])]


def _fittest(pop, contests, **kwargs):  # type: ignore[no-untyped-def]
    values = pop.get("F")[:, 0]
    return contests[np.arange(len(contests)), np.argmin(values[contests], axis=1)][:, np.newaxis]


def _sorted(plans: IntArray) -> IntArray:
    platoons, seconds = np.hsplit(plans, 2)
    order = np.argsort(-platoons, axis=1, kind="stable")
    return np.hstack([np.take_along_axis(platoons, order, axis=1), np.take_along_axis(seconds, order, axis=1)])
