"""A policy of stable-baselines3 that starts near the neutral action and is slow to change its mind."""

from __future__ import annotations

import math
from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.distributions import Distribution
from stable_baselines3.common.policies import ActorCriticPolicy

from cps_agents.zoo.wired import Head, Outputs
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.learning.wiring import WiredBox
from cps_envs.core.types import Array, Observation

ILLEGAL = -1e8  # logit of an action that the mask forbids


class StickyPolicy(ActorCriticPolicy):
    """`MlpPolicy` for the environments of `cps_agents.sb3.make`, with discrete or continuous actions.

    The first network output is the neutral action. Discrete logits get a bonus for the agent's last action, so that an
    untrained policy keeps an action for a while, and a run-up or a slow swing is explored as a whole. The network can
    overrule the bonus at once. Illegal actions are never drawn.

    Raises:
        ConfigurationError: the environments are not those of `make`.
    """

    def __init__(
        self, observation_space: spaces.Space[Any], action_space: spaces.Space[Any], *args: Any, **kwargs: Any
    ):
        if not isinstance(observation_space, WiredBox):
            raise ConfigurationError('StickyPolicy plays in environments of cps_agents.sb3.make("RogueAttack")')
        self._last: torch.Tensor | None = None
        super().__init__(observation_space, action_space, *args, **kwargs)
        start(self, observation_space)

    def _build_last(self, observations: torch.Tensor) -> None:
        """Note what is added to the logits of these observations (B, n)."""
        space: Any = self.observation_space
        columns, untrained = space.columns, space.untrained
        bonus = untrained.stickiness * observations[:, columns.scaled : columns.scaled + columns.last_action]
        if columns.mask:
            bonus = bonus + ILLEGAL * (1.0 - observations[:, -columns.mask :])
        self._last = bonus if untrained.choices else None

    def forward(self, obs: Any, deterministic: bool = False) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Actions, values and log-likelihoods."""
        self._build_last(obs)
        return super().forward(obs, deterministic)

    def evaluate_actions(self, obs: Any, actions: torch.Tensor) -> Any:
        """Values, log-likelihoods and entropy."""
        self._build_last(obs)
        return super().evaluate_actions(obs, actions)

    def get_distribution(self, obs: Any) -> Distribution:
        """The distribution of the actions."""
        self._build_last(obs)
        return super().get_distribution(obs)

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        if self._last is None:
            return super()._get_action_dist_from_latent(latent_pi)
        distribution: Any = self.action_dist
        found: Distribution = distribution.proba_distribution(action_logits=self.action_net(latent_pi) + self._last)
        return found


def neutral_start(model: Any) -> None:
    """Let an untrained model of `MlpPolicy` begin near the neutral action, as `StickyPolicy` does by itself.

    Raises:
        ConfigurationError: its environments are not those of `make`.
    """
    space = model.observation_space
    if not isinstance(space, WiredBox):
        raise ConfigurationError('neutral_start needs environments of cps_agents.sb3.make("RogueAttack")')
    start(model.policy, space)


def start(policy: ActorCriticPolicy, space: WiredBox) -> None:
    """Set the last layer so that the policy plays as the role's untrained one does."""
    untrained, last = space.untrained, policy.action_net
    assert isinstance(last, torch.nn.Linear)
    with torch.no_grad():
        last.weight.zero_()
        wanted = untrained.bias if untrained.choices else untrained.neutral
        last.bias.copy_(torch.as_tensor(wanted, dtype=last.bias.dtype))
        if not untrained.choices:
            policy.log_std.fill_(math.log(untrained.deviation))


def outputs_of_model(model: Any) -> Outputs:
    """What a model's policy says to rows of inputs (n, k): logits of discrete actions, means of continuous ones."""
    policy, space = model.policy, model.action_space

    def outputs(rows: Observation) -> Array:
        with torch.inference_mode():
            seen = torch.as_tensor(rows, device=policy.device)
            if hasattr(policy, "q_net"):  # DQN; of the values only the largest legal one counts
                values: Array = policy.q_net(seen).cpu().numpy()
                return values
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
    """How a model's outputs become actions; its policy has added what belongs to the last action already."""
    deviation = getattr(model.policy, "log_std", None)
    return Head(0.0, None if deviation is None else deviation.detach().cpu().numpy(), sampled)
