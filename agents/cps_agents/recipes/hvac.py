"""Recipes of the HVAC problem: networks, and policy search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe, Situation
from cps_envs.core.types import Array, BoolArray, FloatArray, Role

if TYPE_CHECKING:
    from cps_envs.core.game import Game


@dataclass(frozen=True)
class HvacAttack(Recipe):
    """One network for one, two or three compromised sensors of four, against MTD2."""

    name: str = "hvac-attack-ppo"
    problem: str = "hvac"
    opponent: str = "mtd2"
    preset: str = "paper"  # the setting that the ramps' figures are of
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"num_compromised": [1, 3]})
    unseen: tuple[str, ...] = (  # what is left: whose sensors, the age of the attack, and the mean residuals
        "measured",
        "reading",
        "temperature",  # beyond 35 C it says no more
        "residual",
        "elapsed_h",
        "time_of_day",
        "last_choice",
        "last_estimate",
        "heating",
    )
    hold: int = 4  # 8 minutes, in which a ramp moves by 0.1 C
    reward_scale: float = 0.004  # a day is worth 1 to 10
    total_steps: int = 170_000
    num_envs: int = 48
    steps_per_update: int = 180  # whole days, for returns without bootstrapping
    batch_size: int = 1024
    epochs: int = 4
    learning_rate: float = 1e-4  # larger steps fall over the edge beyond which MTD2 discards the sets
    target_kl: float = 0.01  # for the same reason
    discount: float = 1.0  # the age of the attack tells how much of the day is left
    gae_lambda: float = 1.0  # at 0.97 the policy crosses the edge: the loss comes hours later
    initial_deviation: float = 0.006  # 0.09 C; noise costs residual that the attack wants for itself
    teacher: str = "brink?gain=0.2&margin_c2=0.02"  # a gain for held actions; the margin is for errors of imitation
    teacher_episodes: int = 96
    teacher_epochs: int = 300  # 60 leave errors of 0.2 C, too many for the edge
    value_warm_up: int = 4
    evaluations: int = 12
    evaluation_episodes: int = 96

    def learned(self, game: Game, rewards: FloatArray, ended: BoolArray) -> FloatArray:
        """ln(1 + squared deviation): else days with three compromised sensors would outweigh all others.

        What deviates more at every moment is better by both; the reports keep A_impact.
        """
        states = game.config.num_steps - game.metrics()["onset_step"]
        level: FloatArray = np.log1p(rewards * states)
        return level


@dataclass(frozen=True)
class HvacDefense(Recipe):
    """One network that chooses a set of sensors, over the preset's mix of attack-free, scripted and stealthy days."""

    name: str = "hvac-defense-ppo"
    problem: str = "hvac"
    role: Role = "defender"
    preset: str = "easy"
    algorithm: str = "maskable-ppo"  # sets cannot be chosen before the window is full
    unseen: tuple[str, ...] = (
        "reading",  # the residuals say what they are worth
        "better_half",  # follows from the residuals
        "last_choice",
        "outdoor_c",  # the estimates contain the weather
        "time_of_day",
    )
    hold: int = 8  # 16 minutes: short beside the window of 6.7 h, and 90 decisions a day instead of 719
    reward_scale: float = 0.05  # a day is worth -1 to -20
    total_steps: int = 300_000
    num_envs: int = 256  # plants and attacks differ so much that an update should see many days
    steps_per_update: int = 45
    batch_size: int = 2880
    epochs: int = 6
    discount: float = 0.995  # of 16 minutes: the integrator and the slow wall remember for hours
    entropy_bonus: float = 0.003
    hidden: tuple[int, ...] = (128, 128)  # the estimates of 16 choices have to be compared
    teacher: str = "mtd2"  # which sets pass is the first thing to know
    teacher_episodes: int = 128
    teacher_epochs: int = 40
    value_warm_up: int = 3
    evaluation_episodes: int = 200

    def learned(self, game: Game, rewards: FloatArray, ended: BoolArray) -> FloatArray:
        """Minus the root of the squared deviation: else the few worst days would outweigh all others.

        What deviates less at every moment is better by both; the reports keep A_impact.
        """
        deviation: FloatArray = -np.sqrt(-rewards)
        return deviation


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
    overrides: Mapping[str, Any] = field(default_factory=dict)
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
