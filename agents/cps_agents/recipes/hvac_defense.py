"""Recipes of `HvacDefense`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cps_agents.learning.recipe import Recipe
from cps_envs.core.types import BoolArray, FloatArray, Role

if TYPE_CHECKING:
    from cps_envs.core.game import Game


@dataclass(frozen=True)
class HvacDefense(Recipe):
    """One network that chooses a set of sensors, over the preset's mix of attack-free, scripted and stealthy days."""

    name: str = "hvac-defense-ppo"
    problem: str = "hvac"
    role: Role = "defender"
    preset: str = "easy"
    algorithm: str = "maskable-ppo"  # sets cannot be chosen before the window is full
    unseen: tuple[str, ...] = (
        "reading",  # the residuals say what they are worth
        "better_half",  # follows from the residuals
        "last_choice",
        "outdoor_c",  # the estimates contain the weather
        "time_of_day",
    )
    hold: int = 8  # 16 minutes: short beside the window of 6.7 h, and 90 decisions a day instead of 719
    reward_scale: float = 0.05  # a day is worth -1 to -20
    total_steps: int = 300_000
    num_envs: int = 256  # plants and attacks differ so much that an update should see many days
    steps_per_update: int = 45
    batch_size: int = 2880
    epochs: int = 6
    discount: float = 0.995  # of 16 minutes: the integrator and the slow wall remember for hours
    entropy_bonus: float = 0.003
    hidden: tuple[int, ...] = (128, 128)  # the estimates of 16 choices have to be compared
    teacher: str = "mtd2"  # which sets pass is the first thing to know
    teacher_episodes: int = 128
    teacher_epochs: int = 40
    value_warm_up: int = 3
    evaluation_episodes: int = 200

    def learned(self, game: Game, rewards: FloatArray, ended: BoolArray) -> FloatArray:
        """Minus the root of the squared deviation: else the few worst days would outweigh all others.

        What deviates less at every moment is better by both; the reports keep A_impact.
        """
        deviation: FloatArray = -np.sqrt(-rewards)
        return deviation
