"""Policy search in the disbanding problem: the numbers of `cacc`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe, Situation
from cps_envs.core.types import Array, FloatArray, Role
from cps_envs.disbanding.config import PAPER
from cps_envs.testbed.config import BASELINE

# The chapter's own attacks, on the roads of its tables and a little beyond.
TABLE_ROADS: Mapping[str, Any] = {"desired_gap_m": (3.8, 5.2)}
# Up to three platoons disbanded 5 to 130 s apart, or at random times, mostly near the front.
PAUSES = ",".join(f'"timed?pause_s={pause_s}"' for pause_s in (5, 15, 30, 50, 75, 100, 130))
WORST = f'mixture?policies=["random?front_bias=3",{PAUSES}]'
ROADS: Mapping[str, Any] = {"desired_gap_m": (3.8, 6.0), "attack_budget": (1, 3), "duration_s": 150.0}
DISTURBED = (
    Situation(3, WORST, "easy", {**ROADS, "correction_noise_mps2": 0.5}),
    Situation(2, WORST, "easy", {**ROADS, "correction_noise_mps2": 0.8}),
)


@dataclass(frozen=True)
class CaccBroadcast(Recipe):
    """Every vehicle by its own sensors, its predecessor's radio and the broadcast of the disbanded vehicle ahead.

    A third of the episodes disturb the actuators, which a controller that follows closely has to get through.
    """

    name: str = "disbanding-cacc-broadcast"
    problem: str = "disbanding"
    role: Role = "defender"
    algorithm: str = SEARCH
    family: str = "disbanding-broadcast"
    preset: str = "paper"
    overrides: Mapping[str, Any] = field(
        default_factory=lambda: {"tau_s": (0.08, 0.55), "collision_penalty": 1.0, "report": "safety"}
    )
    opponent: str = "lead"
    scenes: tuple[Situation, ...] = (
        Situation(2, overrides={**TABLE_ROADS, "duration_s": 100.0}),  # by then all drive on
        Situation(6, "table_2_3", overrides=TABLE_ROADS),  # the harder attack, so more of it
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
class CaccLocal(CaccBroadcast):
    """The same without the broadcast: every vehicle by its own sensors and its predecessor's radio alone."""

    name: str = "disbanding-cacc"
    family: str = "disbanding-local"
    scenes: tuple[Situation, ...] = (
        Situation(3, overrides={**TABLE_ROADS, "duration_s": 100.0}),
        Situation(4, "table_2_3", overrides=TABLE_ROADS),
        *DISTURBED,
    )
    search_deviation: float = 0.2
    total_steps: int = 12 * 12 * 15  # 15 generations
    evaluations: int = 3
    least_gap_m: float = 1.5
    gap_price_per_m: float = 1.0


ROBOTS: Mapping[str, Any] = {  # the string of the test bed on this problem's own road, where it differs from `paper`
    name: value for name, value in asdict(BASELINE.road).items() if value != getattr(PAPER, name)
}


@dataclass(frozen=True)
class CaccRobots(CaccBroadcast):
    """For nine robots on a circle: trained on a road of their size, never on the test bed.

    Noise and lags stand for what a road lacks: camera, filter, wheels. Longer searches fit the road, not the robots.
    """

    name: str = "disbanding-cacc-robots"
    overrides: Mapping[str, Any] = field(
        default_factory=lambda: {
            **ROBOTS,
            "duration_s": 50.0,
            "tau_s": (0.1, 0.5),
            "correction_noise_mps2": 0.5,
            "collision_penalty": 1.0,
            "report": "safety",
        }
    )
    opponent: str = "plan?events=[[3, 20]]"  # that of the test bed, whose module would load the compiler here
    scenes: tuple[Situation, ...] = (Situation(6),)
    total_steps: int = 12 * 6 * 20  # 20 generations
    evaluations: int = 4
    evaluation_episodes: int = 60
    least_gap_m: float = 1.5  # between centres; bodies touch at 1 m


ATTACKED: Mapping[str, Any] = {"quiet_share": 0.0}
LOSSY: Mapping[str, Any] = {**ATTACKED, "hop_delay_s": 0.1, "hop_loss": 0.3}
JAMMED = 'mixture?policies=["timed?jam=1","timed?jam=2","timed?jam=3"]'


@dataclass(frozen=True)
class CaccRadio(CaccBroadcast):
    """Preset `learning`: the warning comes late or is lost, and each vehicle also acts on what it sees itself.

    A vehicle that knows too late collides. So an episode with a collision costs as much as many percent of speed.
    """

    name: str = "disbanding-cacc-radio"
    family: str = "disbanding-radio"
    preset: str = "learning"
    overrides: Mapping[str, Any] = field(default_factory=dict)
    scenes: tuple[Situation, ...] = (
        Situation(3, "lead", overrides=LOSSY),
        Situation(4, WORST, overrides=LOSSY),
        Situation(2, WORST, overrides=ATTACKED),
        Situation(2, JAMMED, overrides=ATTACKED),
        Situation(1, "none"),
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
