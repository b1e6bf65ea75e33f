"""The `info` of every interface: the problem's metrics under the same keys, and the legal actions."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_envs.core.game.game import Game
from cps_envs.core.types import BoolArray, Role


def episode_info(game: Game, role: Role, b: int = 0) -> dict[str, Any]:
    """The info of one environment: metrics as Python numbers, `action_mask` where the role has one.

    The mask is an int8 array (k,), flattened for MultiDiscrete.
    """
    info: dict[str, Any] = game.episode_metrics(b)
    if (mask := game.episode_mask(role, b)) is not None:
        info["action_mask"] = mask
    return info


def batch_info(game: Game, role: Role, envs: BoolArray | None = None) -> dict[str, Any]:
    """The info of the marked environments (default: all) in the layout of Gymnasium's vector form.

    That is an array `key` (B, ...) for each entry, and a mask `_key` (B,) of the environments that have it.
    `action_mask` is an int8 array (B, k), flattened for MultiDiscrete.
    """
    info: dict[str, Any] = {}
    for name, values in game.metrics().items():
        info[name] = values.copy() if envs is None else np.where(envs, values, 0)
    mask = game.action_mask(role)
    if mask is not None:
        info["action_mask"] = mask.view(np.int8)  # it is fresh
    marks = np.ones((len(info), game.num_envs), np.bool_)  # made at once: twice as fast as an array for each key
    if envs is not None:
        marks &= envs
    for name, mark in zip(tuple(info), marks, strict=True):
        info[f"_{name}"] = mark
    return info
