"""The seeded search that found the coefficients of `feedback`: evolution strategy with covariance adaptation.

`cps-envs search-feedback --trials 601 --out feedback.json` made the file `feedback.json` beside this module.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np

from cps_baselines.disbanding.feedback import SHAPE, LinearFeedback
from cps_baselines.evolution import make_strategy
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray, Role
from cps_envs.disbanding.problem import DISBANDING

FIRST_DRAW = 10_000_000  # far from the seeds that anything is evaluated on
Report = Callable[[int, dict[str, Any]], None]  # trials so far, the result so far


@dataclass(frozen=True)
class FeedbackSearch:
    """What is searched for; every field is written into the result.

    A candidate is judged on the twelve cells of Tables 2.2 and 2.3 and on draws of the preset `learning`. The draws are
    needed: coefficients fitted to the cells alone get 14 points there and collide after a change of the sixth digit.
    """

    trials: int = 600  # candidate policies
    population: int = 20  # candidates per generation
    spread: float = 0.3  # initial standard deviation of a coefficient; the search starts at zero
    seed: int = 0
    taus_s: tuple[float, ...] = (0.1, 0.3, 0.5)
    desired_gaps_m: tuple[float, ...] = (4.0, 5.0)
    attacks: tuple[str, ...] = ("lead", "table_2_3")
    draws: int = 8  # episodes of the preset `learning` against random plans, seeds FIRST_DRAW and up
    collision_cost: float = 0.3  # points of E_v per collided intact vehicle, as in the preset `learning`


def search_feedback(search: FeedbackSearch, report: Report | None = None) -> dict[str, Any]:
    """The best coefficients (2, 6) with their cost and the search that found them, ready for JSON.

    A candidate's cost is its mean E_v (all, percent) over the episodes, plus the cost of collisions.
    """
    strategy = make_strategy(np.zeros(np.prod(SHAPE)), search.spread, population=search.population, seed=search.seed)
    best, cost, trials = np.zeros(SHAPE), np.inf, 0
    found: dict[str, Any] = {}
    while trials < search.trials:
        candidates = strategy.ask()
        costs = candidate_costs(np.reshape(candidates, (-1, *SHAPE)), search)
        strategy.tell(candidates, costs.tolist())
        trials += len(candidates)
        if costs.min() < cost:
            cost, best = float(costs.min()), np.reshape(candidates[int(costs.argmin())], SHAPE)
        found = {"weights": np.round(best, 6).tolist(), "cost": round(cost, 4), "search": asdict(search)}
        if report is not None:
            report(trials, found)
    return found


def candidate_costs(weights: FloatArray, search: FeedbackSearch) -> FloatArray:
    """Costs (P,) of candidates (P, 2, 6), all played at once for each setting."""
    cells = product(search.taus_s, search.desired_gaps_m, search.attacks)
    settings = [("paper", {"tau_s": tau, "desired_gap_m": gap}, attack, 0) for tau, gap, attack in cells]
    settings += [("easy", {}, "random", FIRST_DRAW + draw) for draw in range(search.draws)]
    costs = np.zeros(len(weights))
    for preset, overrides, attack, seed in settings:
        config = DISBANDING.config(preset, overrides)
        defender = LinearFeedback(DISBANDING.game(config, 1).spec("defender"), weights)
        players: dict[Role, PolicyReference] = {"attacker": attack, "defender": defender}
        outcome = play_episodes(DISBANDING, config, players, [seed] * len(weights))
        costs += outcome["velocity_error_all"] + search.collision_cost * outcome["collided_intact"]
    return costs / len(settings)
