"""Recipes of `HvacAttack`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cps_agents.learning.recipe import Recipe
from cps_envs.core.types import BoolArray, FloatArray

if TYPE_CHECKING:
    from cps_envs.core.game import Game

EXPECTED_C2 = np.array([7.0, 700.0, 5500.0])  # the teacher's A_impact against MTD1, by compromised sensors


@dataclass(frozen=True)
class HvacAttack(Recipe):
    """One network for one, two or three compromised sensors of four, against MTD2."""

    name: str = "hvac-attack-ppo"
    problem: str = "hvac"
    opponent: str = "mtd2"
    preset: str = "paper"  # the setting that the ramps' figures are of
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"num_compromised": [1, 3]})
    unseen: tuple[str, ...] = (  # what is left: whose sensors, the age of the attack, and the mean residuals
        "measured",
        "reading",
        "temperature",  # beyond 35 C it says no more
        "residual",
        "elapsed_h",
        "time_of_day",
        "last_choice",
        "last_estimate",
        "heating",
    )
    hold: int = 4  # 8 minutes, in which a ramp moves by 0.1 C
    reward_scale: float = 0.004  # a day is worth 1 to 10
    total_steps: int = 170_000
    num_envs: int = 48
    steps_per_update: int = 180  # whole days, for returns without bootstrapping
    batch_size: int = 1024
    epochs: int = 4
    learning_rate: float = 1e-4  # larger steps fall over the edge beyond which MTD2 discards the sets
    target_kl: float = 0.01  # for the same reason
    discount: float = 1.0  # the age of the attack tells how much of the day is left
    gae_lambda: float = 1.0  # at 0.97 the policy crosses the edge: the loss comes hours later
    initial_deviation: float = 0.006  # 0.09 C; noise costs residual that the attack wants for itself
    teacher: str = "brink?gain=0.2&margin_c2=0.02"  # a gain for held actions; the margin is for errors of imitation
    teacher_episodes: int = 96
    teacher_epochs: int = 300  # 60 leave errors of 0.2 C, too many for the edge
    value_warm_up: int = 4
    evaluations: int = 12
    evaluation_episodes: int = 96

    def learned(self, game: Game, rewards: FloatArray, ended: BoolArray) -> FloatArray:
        """ln(1 + squared deviation): else days with three compromised sensors would outweigh all others.

        What deviates more at every moment is better by both; the reports keep A_impact.
        """
        states = game.config.num_steps - game.metrics()["onset_step"]
        level: FloatArray = np.log1p(rewards * states)
        return level


@dataclass(frozen=True)
class HvacAttackMtd1(HvacAttack):
    """The same against MTD1, which has no edge: it compares the newest residuals only."""

    name: str = "hvac-attack-mtd1-ppo"
    opponent: str = "mtd1"
    hold: int = 8
    reward_scale: float = 5.0  # a day is worth about 5
    total_steps: int = 250_000
    num_envs: int = 192  # with one sensor a day's impact is a matter of chance
    steps_per_update: int = 45
    batch_size: int = 2160
    epochs: int = 6
    learning_rate: float = 3e-4
    target_kl: float = 0.0
    discount: float = 0.999
    gae_lambda: float = 0.97
    initial_deviation: float = 0.02  # 0.3 C: at 0.1 the noise alone keeps a single sensor out of the better half
    teacher: str = "constant?reading_c=10"  # the lowest reading; biases end at 15 C however warm it gets
    teacher_epochs: int = 60
    evaluations: int = 10

    def learned(self, game: Game, rewards: FloatArray, ended: BoolArray) -> FloatArray:
        """Relative to what the number of compromised sensors lets expect, which leaves the best policy the best."""
        relative: FloatArray = rewards / EXPECTED_C2[game.metrics()["num_compromised"].astype(int) - 1]
        return relative
