"""Recipes of `FdiAttack`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cps_agents.learning.recipe import Recipe
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.task import Task

if TYPE_CHECKING:
    from cps_envs.fdi.game import FdiGame

FURTHEST_GAPS = 3.0  # a miss counts as at most so many desired gaps


@dataclass(frozen=True)
class FdiAttack(Recipe):
    """One network for every attacked sensor and target, told by the observation; it never sees a certified plan.

    Far targets are hit only if two pairs collide in the same sample, which a policy that draws every injection anew
    hardly comes upon. A search for plans does, and the network begins with what it has found.
    """

    name: str = "fdi-attack-ppo"
    problem: str = "fdi"
    algorithm: str = "maskable-ppo"
    preset: str = "easy"
    overrides: Mapping[str, Any] = field(
        default_factory=lambda: {
            "attack_action": "share",  # legal whatever the state; optima are mostly at the ends of the interval
            "share_levels": 7,
            "mask": "look_ahead",  # leaves no dead ends within reach
            "shield": True,  # "nothing" becomes the nearest legal injection
        }
    )
    total_steps: int = 300_000  # polish; the search does more of them
    num_envs: int = 1024
    steps_per_update: int = 20  # whole episodes
    batch_size: int = 4096
    epochs: int = 2
    learning_rate: float = 2e-4
    discount: float = 1.0  # paid at the end alone
    hidden: tuple[int, ...] = (128, 128)
    entropy_bonus: float = 0.005
    search_steps: int = 24_000_000  # at 4,000,000 the plans reach 94 and 86 % of the optimum, with one and two sensors
    self_imitation: int = 8
    teacher_epochs: int = 2000  # one batch each; a single wrong injection misses a far target
    evaluations: int = 6
    evaluation_episodes: int = 512  # starts are alike but for the task: all of them with near certainty
    miss_cost: float = 1.0  # of a miss by one desired gap, in shares of the highest speed known

    def masks(self, game: FdiGame) -> BoolArray | None:  # type: ignore[override]
        """Entries of sensors that nobody attacks mean nothing: they are fixed, lest they be noise."""
        if game.config.attack_action != "share":
            return super().masks(game)
        attacked = _table(game.tasks, game.config.num_vehicles)[0][game.state.task]
        masks = np.repeat(attacked[:, :, np.newaxis], game.config.share_levels + 1, axis=2)
        masks[:, :, 0] = ~attacked
        return masks.reshape(len(masks), -1)

    def learned(self, game: FdiGame, rewards: FloatArray, ended: BoolArray) -> FloatArray:  # type: ignore[override]
        """Shares of the highest speed known; a miss costs the more the further the target's gap is from closed.

        Every task can be hit, and any hit is worth more than any miss: the best attack stays the best.
        """
        target = _table(game.tasks, game.config.num_vehicles)[1][game.state.task]
        gaps = 1 + game.state.error[np.arange(game.num_envs), target] / game.config.desired_gap_m
        metrics = game.metrics()
        miss = self.miss_cost * (np.clip(gaps, 0, FURTHEST_GAPS) + metrics["illegal"])
        known = metrics["oracle_value_mps"]  # not a number where instances are drawn
        return np.where(ended & (rewards <= 0), -miss, rewards / np.where(known > 0, known, 1.0))


@dataclass(frozen=True)
class FdiAttackDisturbed(FdiAttack):
    """Disturbed platoons with clipped commands, where any collision pays: whom a defender meets. Plain PPO."""

    name: str = "fdi-attack-disturbed-ppo"
    preset: str = "defense"
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"attack_action": "share", "share_levels": 5})
    hold: int = 2  # 0.2 s, as without disturbances
    total_steps: int = 300_000
    num_envs: int = 256
    steps_per_update: int = 50  # whole episodes
    epochs: int = 4
    learning_rate: float = 5e-4
    entropy_bonus: float = 0.01
    search_steps: int = 0  # no two episodes start alike
    self_imitation: int = 0
    evaluation_episodes: int = 256


@lru_cache(maxsize=8)
def _table(tasks: tuple[Task, ...], num_vehicles: int) -> tuple[BoolArray, IntArray]:
    """The attacked readings (T, 2n) and the index of the target (T,) of each task."""
    attacked = np.stack([task.sensors.flags(num_vehicles) for task in tasks])
    return attacked, np.array([task.target - 1 for task in tasks])
