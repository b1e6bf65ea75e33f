"""Recipes of false data injection: networks, and policy search for the contested preset `learning`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cps_agents.learning.recipe import SEARCH, Recipe, Situation
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Role
from cps_envs.fdi.task import Task

if TYPE_CHECKING:
    from cps_envs.fdi.game import FdiGame

FURTHEST_GAPS = 3.0  # a miss counts as at most so many desired gaps


@dataclass(frozen=True)
class FdiAttack(Recipe):
    """One network for every attacked sensor and target, told by the observation; it never sees a certified plan.

    Far targets are hit only if two pairs collide in the same sample, which a policy that draws every injection anew
    hardly comes upon. A search for plans does, and the network begins with what it has found.
    """

    name: str = "fdi-attack-plan"
    problem: str = "fdi"
    algorithm: str = "maskable-ppo"
    preset: str = "easy"
    overrides: Mapping[str, Any] = field(
        default_factory=lambda: {
            "attack_action": "share",  # legal whatever the state; optima are mostly at the ends of the interval
            "share_levels": 7,
            "mask": "look_ahead",  # leaves no dead ends within reach
            "shield": True,  # "nothing" becomes the nearest legal injection
        }
    )
    total_steps: int = 300_000  # polish; the search does more of them
    num_envs: int = 1024
    steps_per_update: int = 20  # whole episodes
    batch_size: int = 4096
    epochs: int = 2
    learning_rate: float = 2e-4
    discount: float = 1.0  # paid at the end alone
    hidden: tuple[int, ...] = (128, 128)
    entropy_bonus: float = 0.005
    search_steps: int = 24_000_000  # at 4,000,000 the plans reach 94 and 86 % of the optimum, with one and two sensors
    self_imitation: int = 8
    teacher_epochs: int = 2000  # one batch each; a single wrong injection misses a far target
    evaluations: int = 6
    evaluation_episodes: int = 512  # starts are alike but for the task: all of them with near certainty
    miss_cost: float = 1.0  # of a miss by one desired gap, in shares of the highest speed known

    def masks(self, game: FdiGame) -> BoolArray | None:  # type: ignore[override]
        """Entries of sensors that nobody attacks mean nothing: they are fixed, lest they be noise."""
        if game.config.attack_action != "share":
            return super().masks(game)
        attacked = _table(game.tasks, game.config.num_vehicles)[0][game.state.task]
        masks = np.repeat(attacked[:, :, np.newaxis], game.config.share_levels + 1, axis=2)
        masks[:, :, 0] = ~attacked
        return masks.reshape(len(masks), -1)

    def learned(self, game: FdiGame, rewards: FloatArray, ended: BoolArray) -> FloatArray:  # type: ignore[override]
        """Shares of the highest speed known; a miss costs the more the further the target's gap is from closed.

        Every task can be hit, and any hit is worth more than any miss: the best attack stays the best.
        """
        target = _table(game.tasks, game.config.num_vehicles)[1][game.state.task]
        gaps = 1 + game.state.error[np.arange(game.num_envs), target] / game.config.desired_gap_m
        metrics = game.metrics()
        miss = self.miss_cost * (np.clip(gaps, 0, FURTHEST_GAPS) + metrics["illegal"])
        known = metrics["oracle_value_mps"]  # not a number where instances are drawn
        return np.where(ended & (rewards <= 0), -miss, rewards / np.where(known > 0, known, 1.0))


@dataclass(frozen=True)
class FdiAttackDisturbed(FdiAttack):
    """Disturbed platoons with clipped commands, where any collision pays: whom a defender meets. Plain PPO."""

    name: str = "fdi-attack-disturbed-ppo"
    preset: str = "defense"
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"attack_action": "share", "share_levels": 5})
    hold: int = 2  # 0.2 s, as without disturbances
    total_steps: int = 300_000
    num_envs: int = 256
    steps_per_update: int = 50  # whole episodes
    epochs: int = 4
    learning_rate: float = 5e-4
    entropy_bonus: float = 0.01
    search_steps: int = 0  # no two episodes start alike
    self_imitation: int = 0
    evaluation_episodes: int = 256


@lru_cache(maxsize=8)
def _table(tasks: tuple[Task, ...], num_vehicles: int) -> tuple[BoolArray, IntArray]:
    """The attacked readings (T, 2n) and the index of the target (T,) of each task."""
    attacked = np.stack([task.sensors.flags(num_vehicles) for task in tasks])
    return attacked, np.array([task.target - 1 for task in tasks])


ATTACKERS = ("none", "oracle", "oracle?start=random", "bang_bang", "random")
ANY_ATTACKER = "mixture?policies=[" + ",".join(f'"{name}"' for name in ATTACKERS) + "]&weights=[1,3,2,1,1]"
READINGS = 560.0  # without injection, in an episode of 800: about what these attackers leave


@dataclass(frozen=True)
class FdiDefense(Recipe):
    """Which readings to believe, against replayed optima, random attacks and none; it never meets a trained attacker.

    It begins as the analytic `model` and learns to raise fewer false alarms.
    """

    name: str = "fdi-defense-ppo"
    problem: str = "fdi"
    role: Role = "defender"
    opponent: str = ANY_ATTACKER  # most false alarms are raised against replayed optima
    preset: str = "defense"
    reward_scale: float = 5.0  # alarms cost little
    total_steps: int = 180_000
    num_envs: int = 128
    steps_per_update: int = 100  # whole episodes
    batch_size: int = 1280
    activation: str = "relu"  # thresholds are sharp
    focus: Mapping[str, float] = field(  # injections are up to 100 levels, and one level is what has to be told apart
        default_factory=lambda: {
            "range_innovation": 0.25,
            "rate_innovation": 0.125,
            "kinematic_residual": 0.25,
            "redundancy_residual": 0.25,
        }
    )
    discount: float = 0.99
    hidden: tuple[int, ...] = (128, 128)
    teacher: str = "model"
    teacher_episodes: int = 256
    teacher_rounds: int = 2
    teacher_epochs: int = 30
    value_warm_up: int = 3
    evaluations: int = 6
    evaluation_episodes: int = 256
    false_alarm_cost_mps: float = 0.01  # for each reading without injection that is replaced in a step

    def learned(self, game: FdiGame, rewards: FloatArray, ended: BoolArray) -> FloatArray:  # type: ignore[override]
        """False alarms cost more than the problem charges, which makes no difference between false and true ones."""
        false = (game.state.trust == 0) & (game.state.injection == 0)
        reward: FloatArray = rewards - self.false_alarm_cost_mps * np.sum(false, axis=1)
        return reward

    def score(self, outcome: Mapping[str, Array]) -> float:
        """As learned from: the return and what false alarms cost."""
        false_alarms = READINGS * float(outcome["false_alarm_rate"].mean())
        return super().score(outcome) - self.false_alarm_cost_mps * false_alarms


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
