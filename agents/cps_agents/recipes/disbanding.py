"""Recipes of disbanding: which platoons to disband, and when; one network for every vehicle; and policy search.

What is searched are the numbers of `cacc`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe, Situation
from cps_envs.core.types import Array, BoolArray, FloatArray, Role
from cps_envs.disbanding.config import PAPER
from cps_envs.testbed.config import BASELINE

if TYPE_CHECKING:
    from cps_envs.disbanding.game import DisbandingGame

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


SETTING: Mapping[str, Any] = {
    "swarm_reward": "local",  # of all vehicles together nobody could tell whose merit a reward is
    "collision_penalty": 1.0,  # points, more than the 0.3 of the preset
    "tau_s": (0.08, 0.55),  # a little beyond what the tables ask for
    "desired_gap_m": (3.8, 5.4),
    "takeover_delay_s": (0.0, 0.5),
    "attack_budget": (1, 2),
}


@dataclass(frozen=True)
class DisbandingDefense(Recipe):
    """Every vehicle by its own sensors, its predecessor's radio and the broadcast of the disbanded vehicle ahead."""

    name: str = "disbanding-defense-ppo"
    problem: str = "disbanding"
    role: Role = "defender"
    opponent: str = 'mixture?policies=["lead","table_2_3","random?front_bias=3"]&weights=[2,2,1]'
    preset: str = "easy"
    overrides: Mapping[str, Any] = field(default_factory=lambda: dict(SETTING))
    swarm: bool = True
    unseen: tuple[str, ...] = ("place",)  # lest it learn where in the string it drives
    hold: int = 10  # 1 s: what is tried out has to last to show in the speed
    played_hold: int = 1  # what is right for 1 s is applied anew each 0.1 s; held, it collides at long lags
    teacher: str = "feedback"
    teacher_episodes: int = 6
    teacher_rounds: int = 3
    teacher_epochs: int = 10
    value_warm_up: int = 1
    initial_deviation: float = 0.08  # 0.5 m/s2
    total_steps: int = 2_000_000  # the imitation is nearly all of it
    num_envs: int = 20
    steps_per_update: int = 30
    batch_size: int = 6000
    learning_rate: float = 5e-4
    discount: float = 0.99
    evaluations: int = 3
    evaluation_episodes: int = 12

    def learned(self, game: DisbandingGame, rewards: FloatArray, ended: BoolArray) -> FloatArray:  # type: ignore[override]
        """A vehicle's reward less that of the nearest disbanded vehicle ahead, and nothing for one that cannot act.

        No vehicle changes what happens ahead of its platoon, so the best policy stays the best; what is left is how
        much better or worse than a copy of that vehicle it does.
        """
        config, state = game.config, game.state
        percent = 100.0 / (config.duration_s * config.desired_speed_mps) / config.max_vehicles
        size, platoons = config.vehicles_per_platoon, config.max_platoons
        disbanded = state.disbanding_s <= (state.step * config.dynamics.dt_s)[:, np.newaxis]
        nearest = np.maximum.accumulate(np.where(disbanded, np.arange(platoons), -1), axis=1)
        nearest = np.pad(nearest[:, :-1], ((0, 0), (1, 0)), constant_values=-1)
        ahead = np.take_along_axis(state.speed, (nearest + 1) * size - 1, axis=1)
        error = percent * config.control_period_s * np.abs(ahead - config.desired_speed_mps)
        able = (nearest >= 0) & ~disbanded
        relative = rewards + np.repeat(error, size, axis=1).ravel()
        return np.where(np.repeat(able, size, axis=1).ravel(), relative, 0.0)


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
