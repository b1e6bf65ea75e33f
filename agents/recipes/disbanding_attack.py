"""Recipes of `DisbandingAttack`: which platoons to disband, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from agents.learning.recipe import Recipe

PLANS = (  # the script `spread` of two, three and four disbandings, and plans with times of all kinds
    "plan?events=[[10,1],[9,99],[8,140],[7,160]]",
    "plan?events=[[10,1],[9,57],[8,113],[7,150]]",
    "plan?events=[[10,1],[9,43],[8,85],[7,127]]",
    "random?front_bias=12",
)
WEIGHTS = (1, 1, 1, 2)


def _mixture() -> str:
    names = ",".join(f'"{plan}"' for plan in PLANS)
    return f"mixture?policies=[{names}]&weights={list(WEIGHTS)}".replace(" ", "")


@dataclass(frozen=True)
class DisbandingAttack(Recipe):
    """One network for one to four disbandings and every lag and gap, against vehicles that nobody defends."""

    name: str = "disbanding-attack-ppo"
    problem: str = "disbanding"
    algorithm: str = "maskable-ppo"
    opponent: str = "none"
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"attack_budget": (1, 4)})
    hold: int = 5  # times matter by some 10 s, and 36 decisions are explored better than 180
    played_hold: int = 1  # else the first attack, best at 1 s, would come at 5 s
    reward_scale: float = 0.1  # returns are 30 to 90
    total_steps: int = 140_000  # the simulation, 50 ms an episode, is nearly all of the cost
    num_lanes: int = 48
    steps_per_update: int = 36  # whole episodes
    batch_size: int = 576
    epochs: int = 10  # samples are dear, updates cheap
    learning_rate: float = 1e-3
    discount: float = 1.0  # what an attack does goes on to the end, and the clock is observed
    gae_lambda: float = 0.97
    entropy_bonus: float = 0.005
    teacher: str = field(default_factory=_mixture)  # exploring each second anew never waits 100 s for the next attack
    teacher_episodes: int = 160
    teacher_epochs: int = 30
    value_warm_up: int = 2
    evaluations: int = 3
    evaluation_episodes: int = 64
