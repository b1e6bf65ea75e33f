"""The episodes that choose the best network of a run."""

from __future__ import annotations

import numpy as np

from cps_agents.learning.dealing import opponent_of
from cps_agents.learning.demonstrations import divided
from cps_agents.learning.recipe import Recipe
from cps_agents.learning.seeds import VALIDATION
from cps_envs.core.play import play_episodes
from cps_envs.core.policy import Policy
from cps_envs.core.types import Array, other
from cps_envs.registration import find_problem


def validate(recipe: Recipe, policy: Policy) -> dict[str, Array]:
    """What the validation episodes of all variations of a recipe end with, (B,) each."""
    problem = find_problem(recipe.problem)
    found = []
    for config, seeds in divided(recipe, VALIDATION[: recipe.evaluation_episodes]):
        opponent = opponent_of(recipe, problem.game(config, 1))
        found.append(play_episodes(problem, config, {recipe.role: policy, other(recipe.role): opponent}, seeds))
    return {name: np.concatenate([each[name] for each in found]) for name in found[0]}
