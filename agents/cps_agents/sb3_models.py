"""What a model of stable-baselines3 says to rows of inputs, for policies that play it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial, reduce
from typing import Any, TypeAlias

import numpy as np
import torch
from stable_baselines3.common.vec_env import VecEnvWrapper, VecFrameStack, VecNormalize

from cps_agents.zoo.wired import Head, Outputs
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import takes_masks
from cps_envs.core.types import Array, BoolArray, Observation, State

LayerMaker: TypeAlias = partial[Any]  # makes a `Layer` from what sees its outputs


def outputs_of_model(model: Any) -> Outputs:
    """What a plain model says to rows (n, k): logits or values of discrete actions, means of continuous ones."""
    policy, space = policy_of(model), model.action_space

    def outputs(rows: Observation) -> Array:
        with torch.inference_mode():
            policy.set_training_mode(False)
            seen = torch.as_tensor(rows, device=policy.device)
            for name in ("q_net", "quantile_net"):
                if hasattr(policy, name):
                    values: Array = getattr(policy, name)(seen).cpu().numpy()
                    return values.mean(axis=1) if values.ndim == 3 else values
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
    """How a model's outputs become actions: only legal ones where its algorithm knows of masks, as MaskablePPO does."""
    deviation = getattr(policy_of(model), "log_std", None)
    spread = None if deviation is None else deviation.detach().cpu().numpy()
    return Head(spread, sampled, masked=takes_masks(model))


def policy_of(model: Any) -> Any:
    """The network of a model, which may be handed over alone."""
    return getattr(model, "policy", model)


def explores_by_state(model: Any) -> bool:
    """Whether its noise is a function of what it sees, which is drawn now and then and kept: gSDE."""
    policy = policy_of(model)
    return any(getattr(each, "use_sde", False) for each in (policy, getattr(policy, "actor", None)))


def draws(model: Any) -> bool:
    """Whether a model has a distribution of each action to draw from; DQN, TD3 and gSDE, for instance, have none."""
    policy = policy_of(model)
    known = hasattr(policy, "get_distribution") or hasattr(getattr(policy, "actor", None), "get_action_dist_params")
    return known and not explores_by_state(model)


def is_plain(model: Any) -> bool:
    """Whether `outputs_of_model` and `head_of` say all."""
    policy = policy_of(model)
    known = any(hasattr(policy, name) for name in ("get_distribution", "q_net", "quantile_net"))
    return known and not (hasattr(policy, "lstm_actor") or explores_by_state(model))


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


def layers_around(env: Any) -> list[LayerMaker]:
    """What makes a model's inputs in the environments that it learns in, the outermost layer first."""
    found: list[LayerMaker] = []
    while isinstance(env, VecEnvWrapper):
        if isinstance(env, VecNormalize) and env.norm_obs:
            found.append(partial(Normalised, statistics=env))
        elif isinstance(env, VecFrameStack):
            found.append(partial(Stacked, frames=env.stacked_obs.n_stack))
        env = env.venv
    return found


def layers_named(statistics: VecNormalize | None, frames: int, size: int) -> list[LayerMaker]:
    """The same where only statistics are known, and how many frames of `size` inputs the model sees.

    Raises:
        ConfigurationError: the statistics fit neither one observation nor the stacked ones.
    """
    stacked: list[LayerMaker] = [partial(Stacked, frames=frames)] if frames > 1 else []
    if statistics is None or not statistics.norm_obs:
        return stacked
    normalised: list[LayerMaker] = [partial(Normalised, statistics=statistics)]
    shape = np.shape(getattr(statistics.obs_rms, "mean", ()))
    if shape in ((size * frames,), (size,)):
        return stacked + normalised if shape == (size,) else normalised + stacked
    raise ConfigurationError(
        f"vecnormalize has statistics of shape {shape}, and the model sees {size * frames} inputs: name the file that "
        "was saved with this model"
    )


def layered(model: Any, layers: Sequence[LayerMaker]) -> Any:
    """A model that sees its inputs through these layers, the outermost first."""
    inner: Any = RowsFirst(model) if hasattr(policy_of(model), "lstm_actor") else model
    return reduce(lambda within, layer: layer(within), layers, inner)
