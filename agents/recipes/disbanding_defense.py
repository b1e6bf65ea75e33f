"""Recipes of `DisbandingDefense`: one network for every vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.signal import lfilter

from agents.learning.recipe import Recipe
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.game import DisbandingGame

ATTACKS = 'mixture?policies=["lead","table_2_3","spread","random?front_bias=3"]'
SETTINGS: dict[str, Any] = {
    "swarm_reward": "local",
    "collision_penalty": 10.0,
    "tau_s": (0.08, 0.55),
    "desired_gap_m": (3.8, 6.0),
}


@dataclass(frozen=True)
class DisbandingDefense(Recipe):
    """Every vehicle by its own sensors, its predecessor's radio and the broadcast of the disbanded vehicle ahead."""

    name: str = "disbanding-defense-ppo"
    problem: str = "disbanding"
    role: str = "defender"  # type: ignore[assignment]
    opponent: str = ATTACKS
    overrides: Mapping[str, Any] = field(default_factory=lambda: dict(SETTINGS))
    swarm: bool = True
    hold: int = 5
    teacher: str = "feedback"
    teacher_episodes: int = 4
    teacher_rounds: int = 3
    teacher_epochs: int = 10
    value_warm_up: int = 1
    initial_deviation: float = 0.1
    total_steps: int = 4_000_000
    num_lanes: int = 8
    steps_per_update: int = 360
    batch_size: int = 8192
    epochs: int = 4
    learning_rate: float = 3e-4
    discount: float = 0.99
    gae_lambda: float = 0.95
    evaluations: int = 7
    evaluation_episodes: int = 8
    share_behind: float = 0.9  # of a reward that the vehicle ahead of its owner gets too, and so on to the front

    def learned(self, game: DisbandingGame, rewards: FloatArray, ended: BoolArray) -> FloatArray:  # type: ignore[override]
        """A vehicle's reward less that of the nearest disbanded vehicle ahead, and nothing where there is none.

        No vehicle changes what happens ahead of its platoon, so the best policy stays the best; what is left is how
        much better or worse than a copy of that vehicle it does. Nothing either for one behind a collision, which is
        another's fault: exploring, one collision would drag along a hundred vehicles and drown what there is to learn.
        What the vehicles behind get is shared with those ahead, who brake for them.
        """
        config, state = game.config, game.state
        percent = 100.0 / (config.duration_s * config.desired_speed_mps)
        size, platoons = config.vehicles_per_platoon, config.max_platoons
        disbanded = state.disbanding_s <= (state.step * config.dynamics.dt_s)[:, np.newaxis]
        nearest = np.maximum.accumulate(np.where(disbanded, np.arange(platoons), -1), axis=1)
        nearest = np.pad(nearest[:, :-1], ((0, 0), (1, 0)), constant_values=-1)
        ahead = np.take_along_axis(state.speed, (nearest + 1) * size - 1, axis=1)
        error = percent * config.control_period_s * np.abs(ahead - config.desired_speed_mps)
        able = np.repeat(nearest >= 0, size, axis=1)
        at_fault = state.rear_collided & state.collided_intact
        able[:, 1:] &= ~np.maximum.accumulate(at_fault[:, :-1], axis=1)
        relative = rewards.reshape(able.shape) + np.repeat(error, size, axis=1)
        own = np.where(able, relative, 0.0)
        shared: FloatArray = lfilter([1 - self.share_behind], [1, -self.share_behind], own[:, ::-1], axis=1)[:, ::-1]
        return shared.ravel()
