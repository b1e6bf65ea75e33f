"""Recipes of disbanding by policy search: the numbers of the controller `string`, and of an attacker that replans."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe
from cps_agents.learning.scene import Scene
from cps_envs.core.types import Array, FloatArray, Role

# The chapter's own attacks, on the roads of its tables and a little beyond.
TABLE_ROADS: Mapping[str, Any] = {"desired_gap_m": (3.8, 5.2)}
# Up to three platoons disbanded 5 to 130 s apart, or at random times, mostly near the front.
PAUSES = ",".join(f'"timed?pause_s={pause_s}"' for pause_s in (5, 15, 30, 50, 75, 100, 130))
WORST = f'mixture?policies=["random?front_bias=3",{PAUSES}]'
ROADS: Mapping[str, Any] = {"desired_gap_m": (3.8, 6.0), "attack_budget": (1, 3), "duration_s": 150.0}
DISTURBED = (
    Scene(3, WORST, "easy", {**ROADS, "correction_noise_mps2": 0.5}),
    Scene(2, WORST, "easy", {**ROADS, "correction_noise_mps2": 0.8}),
)


@dataclass(frozen=True)
class DisbandingDefenseSearch(Recipe):
    """Every vehicle by its own sensors, its predecessor's radio and the broadcast of the disbanded vehicle ahead.

    A third of the episodes disturb the actuators, which a controller that follows closely has to get through.
    """

    name: str = "disbanding-defense-cma"
    problem: str = "disbanding"
    role: Role = "defender"
    algorithm: str = SEARCH
    family: str = "disbanding-broadcast"
    preset: str = "paper"
    overrides: Mapping[str, Any] = field(
        default_factory=lambda: {"tau_s": (0.08, 0.55), "collision_penalty": 1.0, "report": "safety"}
    )
    opponent: str = "lead"
    scenes: tuple[Scene, ...] = (
        Scene(2, overrides={**TABLE_ROADS, "duration_s": 100.0}),  # by then all drive on
        Scene(6, "table_2_3", overrides=TABLE_ROADS),  # the harder attack, so more of it
        *DISTURBED,
    )
    population: int = 12
    search_deviation: float = 0.25
    total_steps: int = 12 * 13 * 80  # 80 generations
    evaluations: int = 8
    evaluation_episodes: int = 24
    least_gap_m: float = 2.0  # half a metre more than what is asked
    gap_price_per_m: float = 2.0  # points, for what a gap is smaller

    def values(self, outcome: Mapping[str, Array]) -> FloatArray:
        """Less the attacker's payoff and what a small gap costs."""
        missing_m = np.maximum(0.0, self.least_gap_m - outcome["smallest_gap_m"])
        worth: FloatArray = -outcome["return"] - self.gap_price_per_m * missing_m
        return worth


@dataclass(frozen=True)
class DisbandingDefenseLocalSearch(DisbandingDefenseSearch):
    """The same without the broadcast: every vehicle by its own sensors and its predecessor's radio alone."""

    name: str = "disbanding-defense-local-cma"
    family: str = "disbanding-local"
    scenes: tuple[Scene, ...] = (
        Scene(3, overrides={**TABLE_ROADS, "duration_s": 100.0}),
        Scene(4, "table_2_3", overrides=TABLE_ROADS),
        *DISTURBED,
    )
    search_deviation: float = 0.2
    total_steps: int = 12 * 12 * 15  # 15 generations
    evaluations: int = 3
    least_gap_m: float = 1.5
    gap_price_per_m: float = 1.0


ATTACKED: Mapping[str, Any] = {"quiet_share": 0.0}
LOSSY: Mapping[str, Any] = {**ATTACKED, "hop_delay_s": 0.1, "hop_loss": 0.3}
JAMMED = 'mixture?policies=["timed?jam=1","timed?jam=2","timed?jam=3"]'


@dataclass(frozen=True)
class DisbandingDefenseRadioSearch(DisbandingDefenseSearch):
    """Preset `learning`: the warning comes late or is lost, and each vehicle also acts on what it sees itself.

    A vehicle that knows too late collides. So an episode with a collision costs as much as many percent of speed.
    """

    name: str = "disbanding-defense-radio-cma"
    family: str = "disbanding-radio"
    preset: str = "learning"
    overrides: Mapping[str, Any] = field(default_factory=dict)
    scenes: tuple[Scene, ...] = (
        Scene(3, "lead", overrides=LOSSY),
        Scene(4, WORST, overrides=LOSSY),
        Scene(2, WORST, overrides=ATTACKED),
        Scene(2, JAMMED, overrides=ATTACKED),
        Scene(1, "none"),
    )
    search_deviation: float = 0.25
    total_steps: int = 12 * 12 * 10  # 10 generations
    evaluations: int = 2
    evaluation_episodes: int = 60
    least_gap_m: float = 2.0
    gap_price_per_m: float = 2.0
    collision_price: float = 5.0  # points, for an episode with a collision

    def values(self, outcome: Mapping[str, Array]) -> FloatArray:
        """As without a radio, and less what a collision costs."""
        worth: FloatArray = super().values(outcome) - self.collision_price * (outcome["collided_intact"] > 0)
        return worth


TWO: Mapping[str, Any] = {"attack_budget": 2}
DEFENDERS = {  # episodes against each in a generation; `mpc_tuned` costs most and hardly minds when it is attacked
    "none": 2,
    "heuristic": 1,
    "mpc": 1,
    "copy": 1,
    "feedback": 2,
    "zoo:disbanding-defense-local-cma": 2,
}


@dataclass(frozen=True)
class DisbandingAttackSearch(Recipe):
    """One set of numbers for every defender, lag and gap, and for two to four platoons.

    Two platoons against each defender; three and four where nobody defends, which has the most to gain from timing.
    """

    name: str = "disbanding-attack-cma"
    problem: str = "disbanding"
    role: Role = "attacker"
    algorithm: str = SEARCH
    family: str = "disbanding-replanning"
    preset: str = "easy"
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"attack_budget": (1, 4)})
    opponent: str = "none"
    scenes: tuple[Scene, ...] = (
        *(Scene(episodes, defender, overrides=TWO) for defender, episodes in DEFENDERS.items()),
        Scene(1, overrides={"attack_budget": 3}),
        Scene(4, overrides={"attack_budget": 4}),
    )
    population: int = 8
    search_deviation: float = 0.4  # set by hand from grids of plans, the start is good; the search hardly improves it
    total_steps: int = 8 * 14 * 6  # 6 generations
    evaluations: int = 2
    evaluation_episodes: int = 84
