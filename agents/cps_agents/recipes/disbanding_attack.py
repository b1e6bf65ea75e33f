"""Recipes of `DisbandingAttack`: which platoons to disband, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from cps_agents.learning.recipe import Recipe

SHOWN = 'mixture?policies=["spread","random?front_bias=12"]&weights=[2,1]'  # a good plan, and times of all kinds


@dataclass(frozen=True)
class DisbandingAttack(Recipe):
    """One network for one to four disbandings and every lag and gap, against vehicles that nobody defends."""

    name: str = "disbanding-attack-ppo"
    problem: str = "disbanding"
    algorithm: str = "maskable-ppo"
    opponent: str = "none"
    preset: str = "easy"
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"attack_budget": (1, 4)})
    hold: int = 5  # times matter by some 10 s, and 36 decisions are explored better than 180
    played_hold: int = 1  # else the first attack, best at 1 s, would come at 5 s
    reward_scale: float = 0.1  # returns are 30 to 90
    total_steps: int = 200_000  # the simulation, 50 ms an episode, is nearly all of the cost
    num_envs: int = 48
    steps_per_update: int = 36  # whole episodes
    batch_size: int = 576
    epochs: int = 10  # samples are dear, updates cheap
    learning_rate: float = 1e-3
    discount: float = 1.0  # what an attack does goes on to the end, and the clock is observed
    gae_lambda: float = 0.97
    entropy_bonus: float = 0.005  # at 0.05 one run came to 60.3 points instead of 60.6
    teacher: str = SHOWN  # exploring each second anew never waits 100 s for the next attack
    teacher_episodes: int = 160
    teacher_epochs: int = 30
    value_warm_up: int = 2
    evaluations: int = 3
    evaluation_episodes: int = 64
