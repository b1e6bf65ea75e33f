"""Policy search in the HVAC problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe, Situation
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
# Lies of both signs at once: a defender that expects all liars to drift together would believe them.
APART = (
    'mixture?policies=["shaped?keep_noise=true%26rate_c_per_h=0.7%26w2=-1%26w4=-1",'
    '"shaped?keep_noise=true%26rate_c_per_h=0.7%26w3=-1%26w4=-1"]'
)


@dataclass(frozen=True)
class HvacBayes(Recipe):
    """What a defender who weighs sets of liars by Bayes' rule should believe of attacks before it sees one."""

    name: str = "hvac-bayes"
    problem: str = "hvac"
    role: Role = "defender"
    algorithm: str = SEARCH
    family: str = "hvac-bayes-together"
    preset: str = "learning"
    scenes: tuple[Situation, ...] = (
        Situation(28, HIDING),
        Situation(12, BOLD),
        Situation(4, APART),
    )
    population: int = 12
    search_deviation: float = 0.5
    total_steps: int = 12 * 44 * 6  # 6 generations
    evaluations: int = 3
    evaluation_episodes: int = 200

    def values(self, outcome: Mapping[str, Array]) -> FloatArray:
        """Less the root of A_impact: of the impact itself a few days with three liars would decide alone."""
        worth: FloatArray = -np.sqrt(outcome["return"])
        return worth


@dataclass(frozen=True)
class HvacWarmTracker(Recipe):
    """How slowly an attack has to hide from the defender that weighs sets of liars."""

    name: str = "hvac-warm-tracker"
    problem: str = "hvac"
    algorithm: str = SEARCH
    family: str = "hvac-tracker-warm"  # colder lies came to 21 in these episodes, warmer ones to 24
    preset: str = "learning"
    opponent: str = "bayes"
    scenes: tuple[Situation, ...] = (
        Situation(24, overrides={"compromised_weights": (0, 1, 1, 0)}),
        Situation(16, overrides={"compromised_weights": (0, 0, 0, 1)}),  # where most is to be won
    )
    population: int = 10
    search_deviation: float = 1.0
    total_steps: int = 10 * 40 * 8  # 8 generations
    evaluations: int = 4
    evaluation_episodes: int = 200
