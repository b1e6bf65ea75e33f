"""Training steps per second: each recipe beside stable-baselines3's defaults on the same id."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from cps_agents.bench.row import Measurement, Values, Yardsticks
from cps_agents.learning.recipe import IMITATION, SEARCH, SHARED, Recipe
from cps_agents.recipes.finding import RECIPES
from cps_envs.core.problem import Problem

PART = "training"
DEFAULT_STEPS = 2048  # of stable-baselines3's PPO before an update


def items(problems: list[Problem]) -> Iterator[Measurement]:
    """The recipes of some problems that stable-baselines3 trains by reward."""
    names = {problem.name: problem for problem in problems}
    for recipe in RECIPES.values():
        if recipe.problem in names and recipe.algorithm not in (IMITATION, SEARCH, SHARED):
            yield Measurement(PART, recipe.name, partial(_measure, recipe, names[recipe.problem]))


def _measure(recipe: Recipe, problem: Problem, seconds: float, yardsticks: Yardsticks) -> Values:
    """Two updates of each, from random weights; imitation and search, which come first, are not part of it."""
    import torch

    torch.set_num_threads(1)
    own = _own_rate(recipe)
    usual = _default_rate(problem.env_id(recipe.role), masked=recipe.algorithm == "maskable-ppo")
    return {"steps_per_s": own, "default_steps_per_s": usual, "ratio": own / usual}


def _own_rate(recipe: Recipe) -> float:
    """Decisions per CPU second by the recipe; of a team every agent's counts."""
    from cps_agents.learning.model import make_model, seen_columns
    from cps_agents.learning.training_envs import make_envs

    envs: Any = make_envs(recipe, 0)
    columns = seen_columns(envs, recipe)
    scaling = {"columns": columns, "mean": np.zeros(len(columns)), "deviation": np.ones(len(columns))}
    model = make_model(recipe, envs, scaling, 0, "cpu")
    return _rate(model, 2 * envs.num_envs * recipe.steps_per_update)


def _default_rate(env_id: str, *, masked: bool) -> float:
    """The same by PPO, or MaskablePPO, with its default values on the single environment."""
    from sb3_contrib import MaskablePPO
    from stable_baselines3 import PPO

    learner: Any = MaskablePPO if masked else PPO
    return _rate(learner("MlpPolicy", gymnasium.make(env_id), device="cpu"), 2 * DEFAULT_STEPS)


def _rate(model: Any, steps: int) -> float:
    start = time.process_time()
    model.learn(steps)
    return float(model.num_timesteps / (time.process_time() - start))
