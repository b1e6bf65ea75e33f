"""Recipes of `DisbandingDefense`: one network for every vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cps_agents.learning.recipe import Recipe
from cps_envs.core.types import BoolArray, FloatArray, Role

if TYPE_CHECKING:
    from cps_envs.disbanding.game import DisbandingGame

BROADCAST = ("since_disbanding_s", "ahead_speed", "ahead_acceleration", "ahead_distance")
REAR = ("rear_gap_error", "rear_relative_speed")
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
        percent = 100.0 / (config.duration_s * config.desired_speed_mps)
        size, platoons = config.vehicles_per_platoon, config.max_platoons
        disbanded = state.disbanding_s <= (state.step * config.dynamics.dt_s)[:, np.newaxis]
        nearest = np.maximum.accumulate(np.where(disbanded, np.arange(platoons), -1), axis=1)
        nearest = np.pad(nearest[:, :-1], ((0, 0), (1, 0)), constant_values=-1)
        ahead = np.take_along_axis(state.speed, (nearest + 1) * size - 1, axis=1)
        error = percent * config.control_period_s * np.abs(ahead - config.desired_speed_mps)
        able = (nearest >= 0) & ~disbanded
        relative = rewards + np.repeat(error, size, axis=1).ravel()
        return np.where(np.repeat(able, size, axis=1).ravel(), relative, 0.0)


@dataclass(frozen=True)
class DisbandingDefenseLocal(DisbandingDefense):
    """The same without the broadcast: every vehicle by its own sensors and its predecessor's radio alone.

    An imitation of the model-predictive mitigation, corrected where it drives itself; learning by reward added nothing.
    """

    name: str = "disbanding-defense-local-ppo"
    opponent: str = 'mixture?policies=["lead","table_2_3","random?front_bias=3"]&weights=[3,1,1]'
    overrides: Mapping[str, Any] = field(
        default_factory=lambda: {
            **SETTING,
            "desired_gap_m": (3.8, 5.6),
            "num_platoons": 5,  # the teacher solves a program for each vehicle and decision
            "duration_s": 120.0,
        }
    )
    unseen: tuple[str, ...] = ("place", *BROADCAST, *REAR)
    hold: int = 2  # held for 1 s the teacher's actions collide, and it is asked what to do in wrecks
    teacher: str = "mpc_tuned"  # needs no broadcast; `feedback` without it collides
    teacher_noise: float = 0.05  # its own episodes alone let the imitation stop the traffic
    teacher_episodes: int = 5
    teacher_rounds: int = 6
    teacher_epochs: int = 12
    total_steps: int = 20_000
    steps_per_update: int = 20
    batch_size: int = 4320
    evaluations: int = 1
    evaluation_episodes: int = 8
