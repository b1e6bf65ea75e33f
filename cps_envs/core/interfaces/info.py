"""The `info` of every interface: the problem's metrics under the same keys, what a step cost, and the legal actions."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import Problem
from cps_envs.core.learning.side import Side
from cps_envs.core.types import Array, BoolArray


class Costs:
    """`info["cost"]`, as safe learners read it: by how much the metric that a problem counts has grown in a step.

    An episode's sum is to stay within `Problem.cost_limit`.
    """

    def __init__(self, problem: Problem, game: Game) -> None:
        self._metric, self._before = problem.cost, np.zeros(game.num_envs)

    def begin(self, envs: BoolArray) -> None:
        """Follow a reset of the marked episodes (B,): nothing has cost anything."""
        if self._metric:
            self._before = np.where(envs, 0.0, self._before)

    def add(self, metrics: dict[str, Array]) -> dict[str, Array]:
        """The metrics (B,) now and the cost (B,) since the last call; without it where a problem has none."""
        if not self._metric:
            return metrics
        now = np.array(metrics[self._metric], np.float64)
        cost, self._before = now - self._before, now
        return {**metrics, "cost": cost}


def episode_info(game: Game, side: Side, costs: Costs) -> dict[str, Any]:
    """The info of a single environment: metrics as Python numbers, `cost`, `action_mask` where there is one.

    The mask is an int8 array (k,), of a MultiDiscrete action side by side.
    """
    info: dict[str, Any] = {name: values.item(0) for name, values in costs.add(game.metrics()).items()}
    if (masks := side.masks()) is not None:
        info["action_mask"] = masks[0].astype(np.int8)
    return info


def batch_info(side: Side, metrics: dict[str, Array], envs: BoolArray | None = None) -> dict[str, Any]:
    """The info of the marked episodes (default: all) in the layout of Gymnasium's vector form, a row for each agent.

    That is an array `key` (B x rows, ...) for each of the `metrics` (B,), of which `cost` may be one, and a mask `_key`
    (B x rows,) of the rows that have it. `action_mask` is an int8 array (B x rows, k), of MultiDiscrete actions side by
    side.
    """
    info: dict[str, Any] = {}
    for name, values in metrics.items():
        info[name] = values.copy() if envs is None else np.where(envs, values, 0)
    if side.rows > 1:
        info = {name: np.repeat(values, side.rows) for name, values in info.items()}
    masks = side.masks()
    if masks is not None:
        info["action_mask"] = masks.view(np.int8)  # it is fresh
    rows = next(iter(info.values())).shape[0] if info else 0
    marks = np.ones((len(info), rows), np.bool_)  # made at once: twice as fast as an array for each key
    if envs is not None:
        marks &= np.repeat(envs, side.rows)
    for name, mark in zip(tuple(info), marks, strict=True):
        info[f"_{name}"] = mark
    return info
