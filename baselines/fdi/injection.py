"""Attackers that choose injections as levels, whatever the form of the action."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from baselines.fdi.action_form import ActionForm
from baselines.fdi.branch_and_bound import AT_REST
from cps_envs.core.kernels import inlined, kernel
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
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

    masked = True

    def __init__(self, spec: RoleSpec, *, legal: bool = True) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config
        self.legal = legal
        self.form = ActionForm(self.config)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S)."""
        return self.choose(view_of(self.form, seen), seen.masks, state)

    @abstractmethod
    def choose(self, view: View, masks: BoolArray | None, state: State) -> tuple[IntArray, State]:
        """Actions (B, S), and the new state."""

    def say(self, view: View, wishes: IntArray, masks: BoolArray | None) -> IntArray:
        """The actions (B, S) that inject wished levels (B, S)."""
        return self.form.to_actions(view.error, view.attacked, wishes, legal=self.legal, masks=masks)[0]


def view_of(form: ActionForm, seen: Seen) -> View:
    """What an attacker's observations say."""
    envs, slots, n = len(seen), len(form.sensors), form.config.num_vehicles
    view = View(
        np.empty((envs, 2 * n)),
        np.ones((envs, slots), np.bool_),
        np.full(envs, form.config.target - 1),
        np.empty(envs, np.int64),
    )
    _look(seen.observation, seen.fields.offsets, seen.fields.scale, form.config.horizon, form.drawn, *view)
    return view


def task_of(config: FdiConfig, view: View, b: int) -> Task:
    """The task that an episode plays."""
    if view.attacked.shape[1] != 2 * config.num_vehicles:
        return config.fixed_task
    ranges, rates = np.split(view.attacked[b], 2)
    vehicles = (tuple((np.flatnonzero(part) + 1).tolist()) for part in (ranges, rates))
    return Task(Sensors(*vehicles), int(view.target[b]) + 1)


@inlined
def decoded(row: Observation, scale: FloatArray, entry: int) -> float:
    """An entry of an observation (size,) in its field's unit."""
    value: float = row[entry] * scale[1, entry] + scale[0, entry]
    return value


@kernel
def _look(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    horizon: int,
    drawn: bool,
    error: FloatArray,
    attacked: BoolArray,
    target: IntArray,
    step: IntArray,
) -> None:
    """Fill a `View` from observations (B, size), whose fields begin at `offsets`; a fixed task is filled in already."""
    at, n = offsets[0], error.shape[1] // 2
    for b in range(observation.shape[0]):
        row = observation[b]
        for j in range(2 * n):
            entry = at.gap_error + j if j < n else at.relative_speed + j - n
            value = decoded(row, scale, entry)
            error[b, j] = 0.0 if abs(value) < AT_REST else value  # so that attacks start
        step[b] = horizon - int(np.rint(decoded(row, scale, at.steps_left)))
        if drawn:
            for j in range(2 * n):
                attacked[b, j] = decoded(row, scale, at.attacked + j) > 0.5
            for i in range(n):
                if row[at.target + i] > row[at.target + target[b]]:
                    target[b] = i
