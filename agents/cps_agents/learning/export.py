"""From a model of stable-baselines3 to a network that needs no PyTorch, and to a policy with a card."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
import torch
from gymnasium import spaces

from cps_agents.learning.model import FixedScaling
from cps_agents.learning.recipe import Recipe
from cps_agents.learning.run import Run
from cps_agents.learning.training_envs import TrainingEnvs
from cps_agents.machine import versions
from cps_agents.zoo.card import Card
from cps_agents.zoo.network import Dense, Memory, Network
from cps_agents.zoo.policy import TrainedPolicy, count_actions
from cps_envs.core.types import ROLES, other
from cps_envs.registration import find_problem


def network_of_model(model: Any, activation: str) -> Network:
    """The policy network of a PPO, MaskablePPO, RecurrentPPO, SAC or DQN model as arrays.

    Raises:
        TypeError: a model of another kind, or with other inputs than `FixedScaling`.
    """
    policy = model.policy
    part = next((found for name in ("actor", "q_net") if (found := getattr(policy, name, None)) is not None), policy)
    scaling = getattr(part, "pi_features_extractor", part.features_extractor)
    if not isinstance(scaling, FixedScaling):
        raise TypeError(f"{type(model).__name__} has inputs of kind {type(scaling).__name__}, not of this package")
    log_deviation = getattr(policy, "log_std", None)
    return Network(
        columns=scaling.columns.cpu().numpy().astype(np.int64),
        mean=_array(scaling.mean),
        deviation=_array(scaling.deviation),
        layers=tuple(_dense(layer) for layer in _linear_layers(part)),
        activation=activation,
        memory=_memory(policy),
        log_deviation=None if log_deviation is None else _array(log_deviation),
    )


def _linear_layers(part: Any) -> list[torch.nn.Linear]:
    """Hidden layers and output, in order."""
    if hasattr(part, "latent_pi"):  # SAC
        modules = [*part.latent_pi, part.mu]
    elif hasattr(part, "q_net"):  # DQN
        modules = list(part.q_net)
    else:
        modules = [*part.mlp_extractor.policy_net, part.action_net]
    return [module for module in modules if isinstance(module, torch.nn.Linear)]


def _memory(policy: Any) -> Memory | None:
    lstm = getattr(policy, "lstm_actor", None)
    if lstm is None:
        return None
    inward = (_array(lstm.weight_ih_l0).T.copy(), _array(lstm.bias_ih_l0))
    return Memory(inward, (_array(lstm.weight_hh_l0).T.copy(), _array(lstm.bias_hh_l0)))


def _dense(layer: torch.nn.Linear) -> Dense:
    return _array(layer.weight).T.copy(), _array(layer.bias)


def _array(tensor: torch.Tensor) -> Any:
    return tensor.detach().cpu().numpy().astype(np.float32).copy()


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
