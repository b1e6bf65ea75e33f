"""What a model of stable-baselines3 says to rows of inputs, for policies that play it."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.vec_env import VecNormalize

from cps_agents.zoo.wired import Head, Outputs
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import takes_masks
from cps_envs.core.types import Array, BoolArray, Observation, State


def outputs_of_model(model: Any) -> Outputs:
    """What a model's policy says to rows of inputs (n, k): logits of discrete actions, means of continuous ones."""
    policy, space = model.policy, model.action_space

    def outputs(rows: Observation) -> Array:
        with torch.inference_mode():
            policy.set_training_mode(False)
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


def draws(model: Any) -> bool:
    """Whether a model has a distribution of actions to draw from; DQN and TD3, for instance, have none."""
    actor = getattr(model.policy, "actor", None)
    return hasattr(model.policy, "get_distribution") or hasattr(actor, "get_action_dist_params")


def is_plain(model: Any) -> bool:
    """Whether `outputs_of_model` and `head_of` say all: no memory, no noise that depends on what is seen."""
    return not (
        hasattr(model.policy, "lstm_actor") or hasattr(model.policy, "actor") or getattr(model, "use_sde", False)
    )


class Layer:
    """A model with something between what the role shows and what the model sees; `predict` as stable-baselines3's."""

    def __init__(self, model: Any) -> None:
        self._model = model

    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = True,
        action_masks: BoolArray | None = None,
    ) -> tuple[Array, State | None]:
        """Actions (n, ...) and states, arrays (n, ...), for rows (n, k)."""
        more = {"action_masks": action_masks} if action_masks is not None and takes_masks(self._model) else {}
        found: tuple[Array, State | None] = self._model.predict(
            observation, state, episode_start, deterministic, **more
        )
        return found


class RowsFirst(Layer):
    """A recurrent model whose states have the layers first and the rows second, with the rows first."""

    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = True,
        action_masks: BoolArray | None = None,
    ) -> tuple[Array, State | None]:
        """See the base class; states are (n, layers, units)."""
        own = None if state is None else tuple(np.ascontiguousarray(part.swapaxes(0, 1)) for part in state)
        actions, after = super().predict(observation, own, episode_start, deterministic, action_masks)
        return actions, tuple(part.swapaxes(0, 1) for part in after or ())


class Normalised(Layer):
    """A model that sees observations as a `VecNormalize` has made them."""

    def __init__(self, model: Any, statistics: VecNormalize) -> None:
        super().__init__(model)
        self._statistics = statistics

    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = True,
        action_masks: BoolArray | None = None,
    ) -> tuple[Array, State | None]:
        """See the base class."""
        seen: Any = self._statistics.normalize_obs(observation)
        return super().predict(seen, state, episode_start, deterministic, action_masks)


class Stacked(Layer):
    """A model that sees its last frames side by side, as `VecFrameStack` makes them: zeros before an episode."""

    def __init__(self, model: Any, frames: int) -> None:
        super().__init__(model)
        self._frames = frames

    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = True,
        action_masks: BoolArray | None = None,
    ) -> tuple[Array, State | None]:
        """See the base class; the frames (n, frames x k) come before the model's own states."""
        size = observation.shape[1]
        before = np.zeros((len(observation), size * self._frames), np.float32) if state is None else state[0]
        if episode_start is not None:
            before = np.where(episode_start[:, np.newaxis], np.float32(0), before)
        frames = np.concatenate([before[:, size:], observation], axis=1)
        own = None if state is None or len(state) == 1 else state[1:]
        actions, after = super().predict(frames, own, episode_start, deterministic, action_masks)
        return actions, (frames, *(after or ()))


def layered(model: Any, statistics: VecNormalize | None, frames: int) -> Any:
    """A model of a role's own spaces, which sees what the layers of its training have made of them.

    Raises:
        ConfigurationError: the statistics fit neither one observation nor the stacked ones.
    """
    inner: Any = RowsFirst(model) if hasattr(model.policy, "lstm_actor") else model
    if statistics is None:
        return Stacked(inner, frames) if frames > 1 else inner
    size = model.observation_space.shape[0]
    mean: Any = getattr(getattr(statistics, "obs_rms", None), "mean", ())
    if not statistics.norm_obs:
        return layered(model, None, frames)
    if np.shape(mean) == (size,):  # of what was stacked, if anything
        return Stacked(Normalised(inner, statistics), frames) if frames > 1 else Normalised(inner, statistics)
    if np.shape(mean) == (size // frames,):
        return Normalised(Stacked(inner, frames), statistics)
    raise ConfigurationError(
        f"vecnormalize has statistics of shape {np.shape(mean)}, and the model sees {size} inputs: name the file that "
        "was saved with this model"
    )
