"""Attackers that choose injections as levels, whatever the form of the action."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from baselines.fdi.action_form import ActionForm, Pick
from baselines.fdi.branch_and_bound import error_of
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task


class View(NamedTuple):
    """What an attacker sees of B episodes, in units."""

    error: FloatArray  # (B, 2n) true e, m and m/s; exactly zero at rest
    attacked: BoolArray  # (B, S) slots of the action that belong to an attacked sensor
    target: IntArray  # (B,) index of the target vehicle, 0 = last
    step: IntArray  # (B,) steps done


class InjectionPolicy(AnalyticPolicy):
    """Base of attackers that pick a level for each attacked sensor.

    With `legal` a level that would end the episode is replaced by the nearest legal one, and nothing is injected in a
    dead end.
    """

    def __init__(self, spec: RoleSpec, *, legal: bool = True) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config
        self.legal = legal
        self.form = ActionForm(self.config)

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
        action_masks: BoolArray | None = None,
    ) -> tuple[Array, State]:
        """Actions (B, S)."""
        if state is None:
            state = self.begin([np.random.default_rng() for _ in observation], [{}] * len(observation))
        view = self.view(observation)
        pick, state = self.choose(view, state)
        actions, _ = self.form.to_actions(view.error, view.attacked, pick, legal=self.legal, action_masks=action_masks)
        return actions, state

    @abstractmethod
    def choose(self, view: View, state: State) -> tuple[Pick, State]:
        """How to pick the level of each slot once its legal interval is known, and the new state."""

    def view(self, observation: Array) -> View:
        """The decoded observations (B, size)."""
        return view_of(self.spec, observation)


def view_of(spec: RoleSpec, observation: Array) -> View:
    """What an attacker's observations (B, size) say."""
    config: FdiConfig = spec.config
    seen, envs = spec.fields.decode(observation), len(observation)
    if "attacked" in seen:
        attacked, target = seen["attacked"] > 0.5, np.argmax(seen["target"], axis=1)
    else:
        attacked = np.ones((envs, config.fixed_task.sensors.count), np.bool_)
        target = np.full(envs, config.target - 1)
    step = config.horizon - np.rint(seen["steps_left"]).astype(np.int64)
    return View(error_of(seen["gap_error"], seen["relative_speed"]), attacked, target, step)


def task_of(config: FdiConfig, view: View, b: int) -> Task:
    """The task that an episode plays."""
    if view.attacked.shape[1] != 2 * config.num_vehicles:
        return config.fixed_task
    ranges, rates = np.split(view.attacked[b], 2)
    vehicles = (tuple((np.flatnonzero(part) + 1).tolist()) for part in (ranges, rates))
    return Task(Sensors(*vehicles), int(view.target[b]) + 1)


def wished(levels: IntArray) -> Pick:
    """Picks given levels (B, S)."""
    return lambda slot, low, high: levels[:, slot]
