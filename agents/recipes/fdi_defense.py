"""Recipes of `FdiDefense`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from agents.learning.recipe import Recipe
from cps_envs.core.types import Role

ATTACKERS = ("none", "oracle?start=random", "bang_bang", "random")
ANY_ATTACKER = "mixture?policies=[" + ",".join(f'"{name}"' for name in ATTACKERS) + "]"


@dataclass(frozen=True)
class FdiDefense(Recipe):
    """Which readings to believe and how to correct commands, against replayed optima, random attacks and none."""

    name: str = "fdi-defense-ppo"
    problem: str = "fdi"
    role: Role = "defender"
    opponent: str = ANY_ATTACKER
    preset: str = "defense"
    total_steps: int = 1_000_000
    num_lanes: int = 128
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
    learning_rate: float = 1e-4  # repairs an imitated policy; larger steps would forget it
    discount: float = 0.99
    hidden: tuple[int, ...] = (128, 128)
    teacher: str = "model"
    teacher_episodes: int = 256
    teacher_rounds: int = 3
    teacher_epochs: int = 40
    value_warm_up: int = 5
    evaluation_episodes: int = 256
