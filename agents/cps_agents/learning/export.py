"""From a model of stable-baselines3 to a network that needs no PyTorch."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from cps_agents.learning.scaling import FixedScaling
from cps_agents.zoo.network import Dense, Memory, Network


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
