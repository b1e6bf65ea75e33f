"""Inputs of a network: chosen columns of the observation, scaled once to what first episodes show."""

from __future__ import annotations

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from cps_agents.learning.recipe import Recipe
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
    fields = envs.team.fields if envs.team else envs.env.game.fields[recipe.role]
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
    fields = envs.team.fields if envs.team else envs.env.game.fields[recipe.role]
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
