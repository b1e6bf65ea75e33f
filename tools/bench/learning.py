"""Our own PPO end to end: native decisions in a CPU second, and where the time goes."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from cps_agents.bench.row import Measurement, Values, Yardsticks
from cps_agents.learning.recipe import SHARED, Recipe
from cps_agents.recipes.finding import RECIPES
from cps_envs.core.game.problem import Problem

PART = "learning"
UPDATES = 2  # that are measured, after one that is not


class Clock:
    """CPU seconds by name. What is measured inside something else does not count there."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self._inside = 0.0  # of what ended since the call around it began

    def around(self, owner: Any, method: str, name: str) -> None:
        """Measure the calls of a method."""
        call: Callable[..., Any] = getattr(owner, method)

        def measured(*args: Any, **kwargs: Any) -> Any:
            before, self._inside = self._inside, 0.0
            start = time.process_time()
            result = call(*args, **kwargs)
            whole = time.process_time() - start
            self.spent[name] += whole - self._inside
            self._inside = before + whole
            return result

        object.__setattr__(owner, method, measured)


def items(problems: list[Problem]) -> Iterator[Measurement]:
    """The recipes of some problems that our own PPO trains."""
    for recipe in RECIPES.values():
        if recipe.algorithm == SHARED and recipe.problem in {problem.name for problem in problems}:
            yield Measurement(PART, recipe.name, partial(_measure, recipe))


def _measure(recipe: Recipe, seconds: float, yardsticks: Yardsticks) -> Values:
    from cps_agents.learning.shared import make_learner

    learner, clock = make_learner(recipe, 0), Clock()
    for player in learner.envs._match.players.values():
        clock.around(player, "predict", "opponent")
    clock.around(learner.envs, "step", "environment")
    clock.around(learner, "see", "environment")
    clock.around(learner.network, "draw", "forward")
    clock.around(learner, "credit", "forward")
    clock.around(learner, "update", "gradient")
    learner.start()
    learner.improve(1.0)
    clock.spent.clear()
    steps, start = learner.steps, time.process_time()
    for _ in range(UPDATES):
        learner.improve(1.0)
    whole = time.process_time() - start
    shares = {name: clock.spent[name] / whole for name in ("environment", "opponent", "forward", "gradient")}
    return {"steps_per_s": (learner.steps - steps) / whole, **shares, "book_keeping": 1 - sum(shares.values())}
