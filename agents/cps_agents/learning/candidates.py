"""What the candidates of a policy search reach."""

from __future__ import annotations

import numpy as np

from cps_agents.learning.recipe import Recipe
from cps_baselines.family import Family, play_family
from cps_envs.core.types import FloatArray, other
from cps_envs.registration import find_problem


def play_scenes(recipe: Recipe, family: Family, values: FloatArray, first_seed: int, times: int = 1) -> FloatArray:
    """What each candidate reached, (P, episodes), by its numbers (P, k); the same episodes for all.

    `times` as many episodes of each scene as a candidate is judged by in a search.
    """
    problem, reached = find_problem(recipe.problem), []
    for scene in recipe.scenes:
        preset = scene.preset or recipe.preset
        config = problem.config(preset, {**recipe.overrides, **scene.overrides})
        episodes = scene.episodes * times
        opponent = scene.opponent or recipe.opponent or problem.opponents[preset][other(recipe.role)]
        seeds = [first_seed + episode for episode in range(episodes)] * len(values)
        outcome = play_family(family, problem, config, opponent, np.repeat(values, episodes, axis=0), seeds)
        reached.append(recipe.values(outcome).reshape(len(values), episodes))
        first_seed += episodes
    return np.concatenate(reached, axis=1)
