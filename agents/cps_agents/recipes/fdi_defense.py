"""Recipes of `FdiDefense`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from cps_agents.learning.recipe import Recipe
from cps_envs.core.types import Array, BoolArray, FloatArray, Role

if TYPE_CHECKING:
    from cps_envs.fdi.game import FdiGame

ATTACKERS = ("none", "oracle", "oracle?start=random", "bang_bang", "random")
ANY_ATTACKER = "mixture?policies=[" + ",".join(f'"{name}"' for name in ATTACKERS) + "]&weights=[1,3,2,1,1]"
READINGS = 560.0  # without injection, in an episode of 800: about what these attackers leave


@dataclass(frozen=True)
class FdiDefense(Recipe):
    """Which readings to believe, against replayed optima, random attacks and none; it never meets a trained attacker.

    It begins as the analytic `model` and learns to raise fewer false alarms.
    """

    name: str = "fdi-defense-ppo"
    problem: str = "fdi"
    role: Role = "defender"
    opponent: str = ANY_ATTACKER  # most false alarms are raised against replayed optima
    preset: str = "defense"
    reward_scale: float = 5.0  # alarms cost little
    total_steps: int = 180_000
    num_envs: int = 128
    steps_per_update: int = 100  # whole episodes
    batch_size: int = 1280
    activation: str = "relu"  # thresholds are sharp
    focus: Mapping[str, float] = field(  # injections are up to 100 levels, and one level is what has to be told apart
        default_factory=lambda: {
            "range_innovation": 0.25,
            "rate_innovation": 0.125,
            "kinematic_residual": 0.25,
            "redundancy_residual": 0.25,
        }
    )
    discount: float = 0.99
    hidden: tuple[int, ...] = (128, 128)
    teacher: str = "model"
    teacher_episodes: int = 256
    teacher_rounds: int = 2
    teacher_epochs: int = 30
    value_warm_up: int = 3
    evaluations: int = 6
    evaluation_episodes: int = 256
    false_alarm_cost_mps: float = 0.01  # for each reading without injection that is replaced in a step

    def learned(self, game: FdiGame, rewards: FloatArray, ended: BoolArray) -> FloatArray:  # type: ignore[override]
        """False alarms cost more than the problem charges, which makes no difference between false and true ones."""
        false = (game.state.trust == 0) & (game.state.injection == 0)
        reward: FloatArray = rewards - self.false_alarm_cost_mps * np.sum(false, axis=1)
        return reward

    def score(self, outcome: Mapping[str, Array]) -> float:
        """As learned from: the return and what false alarms cost."""
        false_alarms = READINGS * float(outcome["false_alarm_rate"].mean())
        return super().score(outcome) - self.false_alarm_cost_mps * false_alarms
