"""The learner of a recipe: a model of stable-baselines3 or sb3-contrib.

Inputs of its network are chosen columns of the observation, scaled once to what first episodes show.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib import MaskablePPO, RecurrentPPO
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import IMITATION, RECURRENT, Recipe
from cps_agents.learning.training_envs import TrainingEnvs
from cps_agents.zoo.network import CLIP
from cps_envs.core.errors import near
from cps_envs.core.types import Array

DECISIONS = 400  # that the statistics are taken of, with actions that change rarely
LEAST_DEVIATION = 0.01  # of a column; one that hardly varies is not blown up to noise
RENEWED = 0.1  # share of the actions that are drawn anew at a decision


class FixedScaling(BaseFeaturesExtractor):
    """(value - mean) / deviation of some columns, clipped; the numbers do not change in training."""

    def __init__(self, observation_space: spaces.Box, columns: Array, mean: Array, deviation: Array) -> None:
        super().__init__(observation_space, features_dim=len(columns))
        self.columns: torch.Tensor
        self.mean: torch.Tensor
        self.deviation: torch.Tensor
        self.register_buffer("columns", torch.as_tensor(columns, dtype=torch.int64))
        self.register_buffer("mean", torch.as_tensor(mean, dtype=torch.float32))
        self.register_buffer("deviation", torch.as_tensor(deviation, dtype=torch.float32))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Features (B, columns) of observations (B, n)."""
        chosen = observations.index_select(1, self.columns)
        return ((chosen - self.mean) / self.deviation).clamp(-CLIP, CLIP)


def scaling_of(envs: TrainingEnvs, recipe: Recipe, observations: Array) -> dict[str, Array]:
    """What `FixedScaling` takes, from the first observations (B, n) of a run."""
    columns = seen_columns(envs, recipe)
    mean, deviation = focus(envs, recipe, columns, *spread(observations, columns))
    return {"columns": columns, "mean": mean, "deviation": deviation}


def seen_columns(envs: TrainingEnvs, recipe: Recipe) -> Array:
    """The columns of the fields that the recipe leaves the network.

    Raises:
        ValueError: `unseen` names no field.
    """
    fields = envs.fields
    for name in recipe.unseen:
        if name not in fields.slices:
            raise ValueError(f"the observation has no field {name!r}. {near(name, fields.slices)}")
    hidden = [np.arange(fields.size)[fields.slices[name]] for name in recipe.unseen]
    return np.setdiff1d(np.arange(fields.size), np.concatenate(hidden) if hidden else [])


def focus(envs: TrainingEnvs, recipe: Recipe, columns: Array, mean: Array, deviation: Array) -> tuple[Array, Array]:
    """Mean and deviation with those of the recipe's `focus` in place of what has been seen.

    Raises:
        ValueError: `focus` names no field.
    """
    fields = envs.fields
    mean, deviation = mean.copy(), deviation.copy()
    for field in fields:
        if field.name in recipe.focus:
            half = (field.high - field.low) / 2
            rows = np.isin(columns, np.arange(fields.size)[fields.slices[field.name]])
            mean[rows] = -(field.high + field.low) / 2 / half
            deviation[rows] = recipe.focus[field.name] / half
    if unknown := [name for name in recipe.focus if name not in fields.slices]:
        raise ValueError(f"the observation has no field {unknown[0]!r}. {near(unknown[0], fields.slices)}")
    return mean, deviation


def wander(envs: TrainingEnvs, seed: int) -> Array:
    """Observations (N, n) seen while actions are drawn at random now and then."""
    generator = np.random.default_rng(seed)
    envs.reset()
    envs.action_space.seed(seed)
    actions = np.stack([envs.action_space.sample() for _ in range(envs.num_envs)])
    seen = []
    for _ in range(DECISIONS):
        for b in np.flatnonzero(generator.random(envs.num_envs) < RENEWED):
            actions[b] = envs.action_space.sample()
        envs.step_async(actions)
        observation, *_ = envs.step_wait()
        seen.append(observation)
    return np.concatenate(seen)


def spread(observations: Array, columns: Array) -> tuple[Array, Array]:
    """Mean and deviation of the columns (B, n), the deviation at least `LEAST_DEVIATION`."""
    values = observations[:, columns]
    return values.mean(axis=0), np.maximum(values.std(axis=0), LEAST_DEVIATION)


CLASSES: dict[str, type[BaseAlgorithm]] = {
    "ppo": PPO,
    "maskable-ppo": MaskablePPO,
    "recurrent-ppo": RecurrentPPO,
    IMITATION: RecurrentPPO,  # of which it trains the actor
    "sac": SAC,
    "dqn": DQN,
}
ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}
ON_POLICY = ("ppo", "maskable-ppo", *RECURRENT)


def check_fit(recipe: Recipe, envs: TrainingEnvs) -> None:
    """Whether the algorithm can play the actions.

    Raises:
        CommandError: it cannot; the message names one that can.
    """
    box, discrete = isinstance(envs.action_space, spaces.Box), isinstance(envs.action_space, spaces.Discrete)
    if recipe.algorithm == "sac" and not box:
        raise CommandError(f"sac plays continuous actions, not {envs.action_space}: use ppo or maskable-ppo")
    if recipe.algorithm == "dqn" and not discrete:
        raise CommandError(f"dqn plays Discrete actions, not {envs.action_space}: use ppo or sac")
    if recipe.algorithm == "maskable-ppo" and box:
        raise CommandError(f"maskable-ppo plays discrete actions, not {envs.action_space}: use ppo or sac")
    if recipe.algorithm == "maskable-ppo" and recipe.masks(envs.env.game) is None:
        raise CommandError("all actions of this environment are legal at any time: use ppo instead of maskable-ppo")
    if recipe.taught and recipe.algorithm not in ON_POLICY:
        raise CommandError(f"{recipe.algorithm} cannot start from a teacher: use {' or '.join(ON_POLICY)}")


def make_model(recipe: Recipe, envs: TrainingEnvs, scaling: dict[str, Array], seed: int, device: str) -> BaseAlgorithm:
    """An untrained model, whose inputs are scaled by `scaling` (columns, mean, deviation)."""
    common: dict[str, Any] = {
        "learning_rate": Falling(recipe.learning_rate, recipe.final_learning_rate),
        "gamma": recipe.discount,
        "batch_size": recipe.batch_size,
        "seed": seed,
        "device": device,
        "policy_kwargs": {
            "features_extractor_class": FixedScaling,
            "features_extractor_kwargs": scaling,
            "activation_fn": ACTIVATIONS[recipe.activation],
        },
    }
    if recipe.algorithm in ON_POLICY:
        model = _on_policy(recipe, envs, common)
        _favour_neutral(model, envs, recipe.neutral_bonus)
        return model
    common["policy_kwargs"]["net_arch"] = list(recipe.hidden)
    algorithm: Any = CLASSES[recipe.algorithm]
    made: BaseAlgorithm = algorithm("MlpPolicy", envs, **common, **_off_policy_options(recipe, envs))
    return made


def _on_policy(recipe: Recipe, envs: TrainingEnvs, common: dict[str, Any]) -> BaseAlgorithm:
    kwargs = common["policy_kwargs"]
    kwargs["net_arch"] = {"pi": list(recipe.hidden), "vf": list(recipe.hidden)}
    if isinstance(envs.action_space, spaces.Box):
        kwargs["log_std_init"] = float(np.log(recipe.initial_deviation))
    if recipe.algorithm in RECURRENT:
        kwargs["lstm_hidden_size"] = recipe.memory_units
    policy = "MlpLstmPolicy" if recipe.algorithm in RECURRENT else "MlpPolicy"
    algorithm: Any = CLASSES[recipe.algorithm]
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", "You have specified a mini-batch size", UserWarning
        )  # the last one is smaller
        made: BaseAlgorithm = algorithm(
            policy,
            envs,
            n_steps=recipe.steps_per_update,
            n_epochs=recipe.epochs,
            gae_lambda=recipe.gae_lambda,
            clip_range=recipe.clip_range,
            ent_coef=recipe.entropy_bonus,
            vf_coef=recipe.value_weight,
            target_kl=recipe.target_kl or None,
            max_grad_norm=recipe.max_grad_norm,
            **common,
        )
    return made


def _off_policy_options(recipe: Recipe, envs: TrainingEnvs) -> dict[str, Any]:
    options: dict[str, Any] = {
        "buffer_size": recipe.buffer_size,
        "learning_starts": recipe.learning_starts,
        "train_freq": 1,
        "gradient_steps": max(round(recipe.updates_per_step * envs.num_envs), 1),
    }
    return options | ({"exploration_fraction": recipe.exploration_share} if recipe.algorithm == "dqn" else {})


class Falling:
    """A learning rate that falls linearly; a class, so that checkpoints do not depend on pickled code."""

    def __init__(self, first: float, last: float) -> None:
        self.first, self.last = first, last

    def __call__(self, remaining: float) -> float:
        """The rate when a share `remaining` of the steps is left."""
        return self.last + (self.first - self.last) * remaining


def _favour_neutral(model: BaseAlgorithm, envs: TrainingEnvs, bonus: float) -> None:
    """Add to the logits of the neutral action."""
    if not bonus:
        return
    neutral = np.ravel(envs.env.game.neutral_action[envs.env.role])
    counts = np.ravel(getattr(envs.action_space, "nvec", getattr(envs.action_space, "n", 0)))
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(int)
    policy: Any = model.policy
    bias = policy.action_net.bias
    with torch.no_grad():
        bias[torch.as_tensor(starts + neutral[: len(starts)])] += bonus
