"""A first policy by imitation: the likelihood of a teacher's actions is maximised before learning by reward."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

from cps_agents.learning.demonstrations import Demonstrations
from cps_agents.learning.recipe import Recipe

LEARNING_RATE = 1e-3


def imitate(policy: Any, shown: Demonstrations, recipe: Recipe, generator: np.random.Generator) -> float:
    """Fit the policy network; returns the last epoch's mean loss. The deviation of Gaussian actions is left alone."""
    weights = [weight for name, weight in policy.named_parameters() if name != "log_std"]
    steps = recipe.teacher_epochs * -(-len(shown.actions) // recipe.batch_size)
    optimizer = torch.optim.Adam(weights, lr=LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, max(steps, 1))
    losses: list[float] = []
    for _ in range(recipe.teacher_epochs):
        losses = []
        for rows in _batches(len(shown.actions), recipe.batch_size, generator):
            loss = likelihood_loss(policy, shown, rows)
            optimizer.zero_grad()
            torch.autograd.backward(loss)
            optimizer.step()
            schedule.step()
            losses.append(float(loss.detach()))
    return float(np.mean(losses))


def likelihood_loss(policy: Any, shown: Demonstrations, rows: np.ndarray[Any, Any]) -> torch.Tensor:
    """How unlikely the policy finds the actions of some rows; for Gaussian actions, how far off it is."""
    observations = torch.as_tensor(shown.observations[rows], device=policy.device)
    actions = torch.as_tensor(shown.actions[rows], device=policy.device)
    extra = {}
    if shown.masks is not None and isinstance(policy, MaskableActorCriticPolicy):
        extra["action_masks"] = shown.masks[rows]
    distribution = policy.get_distribution(observations, **extra)
    if actions.is_floating_point():
        return torch.nn.functional.mse_loss(distribution.distribution.mean, actions.float())
    likelihood: torch.Tensor = distribution.log_prob(actions)
    return -likelihood.mean()


def _batches(count: int, size: int, generator: np.random.Generator) -> Iterator[np.ndarray[Any, Any]]:
    order = generator.permutation(count)
    for start in range(0, count, size):
        yield order[start : start + size]
