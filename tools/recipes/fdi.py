"""Policy search in false data injection, on the contested preset `learning`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe, Situation
from cps_envs.core.types import Array, FloatArray, Role

FALSE_ALARM_MPS = 0.4  # what an episode with a false alarm costs a defender beside its charges,
HONEST_ALARM_MPS = 12.0  # and one in which nobody attacks: at 4.0 there were as many as those of `bank`
SAFE_GAP_M, PER_METRE_MPS = 1.5, 2.0  # a smaller gap without an attack costs so much for each metre
# Trackers unlike one another: the registered ones, and the answers that searches found to older defenders.
TRACKERS = (
    "tracker",
    "tracker?margin=0.8&late=1.5&swing=1&swing_s=0.5",
    "tracker?margin=1.072&late=2.299&swing=2.032&swing_s=0.9383&range_part=1.052",
    "tracker?margin=0.277&late=1.018&swing=-0.466&swing_s=1.403&range_part=0.1714",
    "tracker?margin=0.1534&late=2.725&swing=-0.377&swing_s=2.65&range_part=0.6174",
    "blind_tracker",
    "blind_tracker?margin=1.831&late=1.341&swing=-0.5837&swing_s=4.432&range_part=1.5",
    "blind_tracker?margin=0.8061&late=2.385&swing=-0.5348&swing_s=3.978&range_part=0.822",
)
LOUD = 'mixture?policies=["swing","random","bang_bang"]'
UNSEEN_GAP: Mapping[str, Any] = {"tasks": "xv4>4", "attack_share": 1.0}  # no other sensor sees the lead's gap


@dataclass(frozen=True)
class FdiHypotheses(Recipe):
    """The numbers of `Hypotheses`: what evidence it takes to distrust a sensor, and for how long.

    Most episodes have attackers that hide in the filter's noise; those that do not are found by any threshold. The
    sensors of the lead's gap, which nobody can check, have a scene of their own: they are an eighth of the tasks and
    most of the damage. A quarter of the episodes has no attack, and a scene besides, so that alarms stay rare.
    """

    name: str = "fdi-hypotheses"
    problem: str = "fdi"
    role: Role = "defender"
    algorithm: str = SEARCH
    family: str = "fdi-hypotheses"
    preset: str = "learning"
    opponent: str = "tracker"
    scenes: tuple[Situation, ...] = (
        *(Situation(4, tracker) for tracker in TRACKERS),
        *(Situation(2, tracker, overrides=UNSEEN_GAP) for tracker in TRACKERS),
        Situation(6, LOUD),
        Situation(48, "none"),
    )
    population: int = 12
    search_deviation: float = 0.8
    total_steps: int = 12 * 102 * 28  # 28 generations
    evaluations: int = 6
    evaluation_episodes: int = 1020

    def values(self, outcome: Mapping[str, Array]) -> FloatArray:
        """Less the attacker's payoff, what false alarms cost, and what small gaps cost where nobody attacks."""
        honest = outcome["attacked"] == 0
        alarm = np.where(honest, HONEST_ALARM_MPS, FALSE_ALARM_MPS) * outcome["false_alarm"]
        small_m = np.where(honest, np.maximum(SAFE_GAP_M - outcome["smallest_gap_m"], 0.0), 0.0)
        worth: FloatArray = -outcome["return"] - alarm - PER_METRE_MPS * small_m
        return worth


@dataclass(frozen=True)
class FdiTaskTracker(Recipe):
    """The numbers of `TaskTracker`: how much the filter is told to be wrong, for each kind of task.

    It meets every registered defender equally often, in episodes that are all attacked.
    """

    name: str = "fdi-task-tracker"
    problem: str = "fdi"
    algorithm: str = SEARCH
    family: str = "fdi-task-tracker"
    preset: str = "learning"
    opponent: str = "cusum"
    scenes: tuple[Situation, ...] = tuple(
        Situation(episodes, defender, overrides={"attack_share": 1.0})
        for defender, episodes in (("bank", 24), ("cusum", 16), ("redundant_cusum", 16), ("chi2", 12), ("none", 4))
    )
    population: int = 14
    search_deviation: float = 0.7
    total_steps: int = 14 * 72 * 32  # 32 generations
    evaluations: int = 8
    evaluation_episodes: int = 288
