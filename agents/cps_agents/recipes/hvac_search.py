"""Recipes of the HVAC problem by policy search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe
from cps_agents.learning.scene import Scene
from cps_envs.core.types import Array, FloatArray, Role

# Attacks that hide in the drift, of both signs, slower and faster, with more and with less noise.
QUIET = ",".join(
    f'"{attack}{sign}"'
    for attack in (
        "tracker?level=0.2",
        "tracker?level=0.4",
        "tracker?level=0.6%26noise=0.8",
        "tracker?level=0.9%26gain=0.2%26noise=0.7",
        "ramp?rate_c_per_h=[0.3,1.5]%26keep_noise=true",
        "ramp?rate_c_per_h=[0.3,1.5]%26exponent=0.5%26keep_noise=true",
        "mimic?keep_noise=true",
    )
    for sign in ("", "%26warmer=true")
)
HIDING = f"mixture?policies=[{QUIET}]"
# The others are found out sooner, if at all they are thought of.
BOLD = (
    'mixture?policies=["none","constant","random","constant?reading_c=28","constant?reading_c=40","listener",'
    '"listener?warmer=true","brink","brink?warmer=true","shaped?keep_noise=true",'
    '"shaped?keep_noise=true%26warmer=true","ramp","ramp?warmer=true"]'
)


@dataclass(frozen=True)
class HvacDefenseSearch(Recipe):
    """What a defender who weighs sets of liars by Bayes' rule should believe of attacks before it sees one."""

    name: str = "hvac-defense-cma"
    problem: str = "hvac"
    role: Role = "defender"
    algorithm: str = SEARCH
    family: str = "hvac-bayes"
    preset: str = "learning"
    scenes: tuple[Scene, ...] = (
        Scene(28, HIDING),
        Scene(12, BOLD),
    )
    population: int = 12
    search_deviation: float = 0.5
    total_steps: int = 12 * 40 * 10  # 10 generations
    evaluations: int = 3
    evaluation_episodes: int = 200

    def values(self, outcome: Mapping[str, Array]) -> FloatArray:
        """Less the root of A_impact: of the impact itself a few days with three liars would decide alone."""
        worth: FloatArray = -np.sqrt(outcome["return"])
        return worth
