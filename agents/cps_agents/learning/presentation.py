"""A network in training as a policy with a card."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_agents.learning.recipe import Recipe
from cps_agents.learning.run import Run
from cps_agents.learning.training_envs import TrainingEnvs
from cps_agents.machine import versions
from cps_agents.zoo.card import Card
from cps_agents.zoo.network import Network
from cps_agents.zoo.policy import TrainedPolicy, count_actions
from cps_envs.core.types import ROLES, other
from cps_envs.registration import find_problem


def make_card(run: Run, envs: TrainingEnvs, facts: Mapping[str, Any]) -> Card:
    """The card of a run's policy with the `facts` about its training seed."""
    recipe, problem = run.recipe, find_problem(run.recipe.problem)
    continuous = isinstance(envs.action_space, spaces.Box)
    return Card(
        name=recipe.name,
        problem=recipe.problem,
        version=problem.version,
        role=recipe.role,
        algorithm=learned_by(recipe, facts.get("steps")),
        opponent=recipe.opponent or problem.opponents[recipe.preset][other(recipe.role)],
        preset=recipe.preset,
        overrides=dict(recipe.overrides),
        recipe=asdict(recipe),
        activation=recipe.activation,
        head="squashed" if recipe.algorithm == "sac" else "gaussian" if continuous else "discrete",
        decentralised=recipe.swarm,
        hold=recipe.played_hold or recipe.hold,
        observation_size=int(np.prod(envs.observation_space.shape or ())),
        actions=count_actions(envs.action_space),
        best=run.seed,
        seeds={str(run.seed): facts},
        command=run.command,
        versions=versions(),
    )


def learned_by(recipe: Recipe, steps: int | None) -> str:
    """What made a checkpoint after so many steps of learning; the recipe's algorithm has had no part in the first."""
    if steps != 0:
        return recipe.algorithm
    return "plan-search" if recipe.search_steps else "imitation" if recipe.taught else "untrained"


def policy_of(card: Card, network: Network) -> TrainedPolicy:
    """The policy of a card in the configuration it was trained with."""
    problem = find_problem(card.problem)
    game = problem.game(problem.config(card.preset, card.overrides), 1)
    return TrainedPolicy(game.spec(next(role for role in ROLES if role == card.role)), card, network)
