"""Recipes of the rogue-vehicle problem by policy search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from cps_agents.learning.recipe import SEARCH, Recipe
from cps_agents.learning.scene import Scene
from cps_agents.recipes.rogue_defense import RogueDefense
from cps_envs.core.types import Role


def _any_of(*references: str) -> str:
    names = ",".join(f'"{reference.replace("&", "%26")}"' for reference in references)
    return f"mixture?policies=[{names}]"


LEARNED = _any_of(*(f"zoo:rogue-attack-{kind}?seed={seed}" for kind in ("ppo", "recurrent") for seed in range(3)))
SEARCHED = _any_of("switching", *(f"switching?against={name}" for name in ("sliding_detection", "pd", "disband_2")))
WAVES = _any_of("duty_square", "square", "square?frequency_hz=0.05", "random")
RESPONDED_TO = ("pd", "sliding", "sliding_detection", "disband_7", "assigned", "assigned?laws=f", "monitor")
CONTESTED = _any_of(  # the attackers of the contest
    "none",
    "square",
    "square?frequency_hz=0.05",
    "duty_square",
    "random",
    "switching",
    *(f"contested?against={name}" for name in RESPONDED_TO),
    "identify",
    "strike",
    "strike?effort=-1",
)
# What a search found at the ratio 1.3 against a defender that had not met it.
EXPLOITER = (
    "tuned?front_gap=0.344&front_rate=-0.668&rear_gap=0.821&rear_rate=-1.359&excess=-0.682&bias=-0.036&hysteresis=0.26"
)


@dataclass(frozen=True)
class RogueDefenseSearch(Recipe):
    """How vehicles give way to an attacker that they know, in the setting of `RogueDefense`."""

    name: str = "rogue-defense-cma"
    problem: str = "rogue"
    role: Role = "defender"
    algorithm: str = SEARCH
    family: str = "rogue-giving-way"
    preset: str = "paper"
    opponent: str = LEARNED  # training seeds 0 to 2; the others are left for judging
    overrides: Mapping[str, Any] = field(
        default_factory=lambda: {
            **RogueDefense().overrides,
            "defense_action": "command",
            "formation_weight_mps2": 2.0,  # at 0.5 the vehicles scatter: damage 8 m/s, cost 18 s
        }
    )
    scenes: tuple[Scene, ...] = (
        Scene(10),
        Scene(6, SEARCHED),
        Scene(6, WAVES),
        Scene(6, EXPLOITER, overrides={"power_ratio": [1.2, 1.3]}),
    )
    population: int = 14
    search_deviation: float = 0.4
    total_steps: int = 14 * 28 * 9  # 9 generations
    evaluations: int = 3
    evaluation_episodes: int = 84


@dataclass(frozen=True)
class RogueMonitorSearch(Recipe):
    """When the coordinator `monitor` suspects somebody, and from which gap on the neighbors of a suspect evade."""

    name: str = "rogue-defense-monitor-cma"
    problem: str = "rogue"
    role: Role = "defender"
    algorithm: str = SEARCH
    family: str = "rogue-monitor"
    preset: str = "learning"
    opponent: str = CONTESTED
    scenes: tuple[Scene, ...] = (Scene(48),)
    population: int = 10
    search_deviation: float = 0.7
    total_steps: int = 10 * 48 * 5  # 5 generations
    evaluations: int = 2
    evaluation_episodes: int = 240
