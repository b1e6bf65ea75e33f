"""What a model of stable-baselines3 says to rows of inputs, for policies that play it."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from cps_agents.zoo.wired import Head, Outputs
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.types import Array, BoolArray, Observation, State


def outputs_of_model(model: Any) -> Outputs:
    """What a model's policy says to rows of inputs (n, k): logits of discrete actions, means of continuous ones."""
    policy, space = model.policy, model.action_space

    def outputs(rows: Observation) -> Array:
        with torch.inference_mode():
            seen = torch.as_tensor(rows, device=policy.device)
            for name in ("q_net", "quantile_net"):  # of values only the largest legal one counts
                if hasattr(policy, name):
                    values: Array = getattr(policy, name)(seen).cpu().numpy()
                    return values.mean(axis=1) if values.ndim == 3 else values
            if not hasattr(policy, "get_distribution"):  # such as SAC, which has no logits
                chosen: Array = model.predict(rows, deterministic=True)[0].reshape(len(rows), -1)
                return chosen
            found: Any = policy.get_distribution(seen)
            if hasattr(found, "distributions"):
                parts = [part.logits for part in found.distributions]
            elif isinstance(found.distribution, list):
                parts = [part.logits for part in found.distribution]
            else:
                parts = [found.distribution.logits if choices_of(space) else found.distribution.mean]
            together: Array = torch.cat(parts, dim=1).cpu().numpy()
            return together

    return outputs


def head_of(model: Any, *, sampled: bool) -> Head:
    """How a model's outputs become actions."""
    deviation = getattr(model.policy, "log_std", None)
    return Head(None if deviation is None else deviation.detach().cpu().numpy(), sampled)


class RowsFirst:
    """A recurrent model whose states have the layers first and the rows second, with the rows first."""

    def __init__(self, model: Any) -> None:
        self._model = model

    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Actions (n, ...) and states (n, layers, units) for rows (n, k)."""
        own = None if state is None else tuple(np.ascontiguousarray(part.swapaxes(0, 1)) for part in state)
        actions, after = self._model.predict(observation, own, episode_start, deterministic)
        return actions, tuple(part.swapaxes(0, 1) for part in after)
