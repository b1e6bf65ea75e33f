"""Opponents and their teachers, side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_agents.learning.recipe import Recipe
from cps_envs.core.game import Game
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.mixture import Mixture
from cps_envs.core.policy import Policy
from cps_envs.core.types import Array, other
from cps_envs.registration import find_problem


class Dealt(Mixture):
    """Plays by its policies in turn, the k-th episode of those that begin together by the k-th one.

    Two of them as both roles of a match pair off: who meets the k-th opponent has the k-th teacher.
    """

    def draw(self, generators: Sequence[np.random.Generator]) -> Array:
        """Which policy (B,) plays each episode."""
        return np.arange(len(generators)) % len(self.policies)


def teacher_of(recipe: Recipe, game: Game) -> Policy:
    """The recipe's teacher, or its teachers in the order of their opponents."""
    if recipe.teachers:
        return Dealt(game.spec(recipe.role), list(recipe.teachers.values()))
    return find_problem(recipe.problem).policy(recipe.teacher, game, recipe.role)


def opponent_of(recipe: Recipe, game: Game) -> PolicyReference:
    """Whom the recipe plays: its opponents in turn where each has a teacher, else its opponent or the preset's."""
    rival = other(recipe.role)
    if recipe.teachers:
        return Dealt(game.spec(rival), list(recipe.teachers))
    return recipe.opponent or find_problem(recipe.problem).opponents[recipe.preset][rival]
