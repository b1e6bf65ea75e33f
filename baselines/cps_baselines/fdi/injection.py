"""Attackers that choose injections as levels, whatever the form of the action."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.action_form import ActionForm, Form
from cps_baselines.fdi.branch_and_bound import AT_REST
from cps_envs.core.compute.kernels import borrowed, inlined, kernel, unpack, view
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import BoolArray, FloatArray, IntArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.state import Constants
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
    dead end. A policy that is `exact` plans with the undefended platoon and exact front sensors.

    Raises:
        ConfigurationError: an exact policy, and a configuration with a filter.
    """

    masked = True
    exact = False

    def __init__(self, spec: RoleSpec, *, legal: bool = True) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config
        self.legal = legal
        if self.exact and self.config.estimator == "kalman":
            raise ConfigurationError(
                f"{type(self).__name__} plans for exact front sensors and no filter, as in preset paper. "
                'With estimator = "kalman" use tracker, blind_tracker, swing, bang_bang or random'
            )
        self.form = ActionForm(self.config)

    def say(self, views: View, wishes: IntArray, masks: BoolArray | None) -> IntArray:
        """The actions (B, S) that inject wished levels (B, S)."""
        return self.form.to_actions(views.error, views.attacked, wishes, legal=self.legal, masks=masks)[0]


def view_of(form: ActionForm, seen: Seen) -> View:
    """What an attacker's observations say."""
    views = new_views(form, len(seen))
    _look(form.held, seen.observation, views)
    return views


def new_views(form: ActionForm, num_envs: int) -> View:
    """What an attacker sees of B episodes, not filled yet."""
    error, attacked = (
        np.empty((num_envs, 2 * form.config.num_vehicles)),
        np.empty((num_envs, len(form.sensors)), np.bool_),
    )
    return View(error, attacked, np.empty(num_envs, np.int64), np.empty(num_envs, np.int64))


def task_of(config: FdiConfig, views: View, b: int) -> Task:
    """The task that an episode plays."""
    if views.attacked.shape[1] != 2 * config.num_vehicles:
        return config.fixed_task
    ranges, rates = np.split(views.attacked[b], 2)
    vehicles = (tuple((np.flatnonzero(part) + 1).tolist()) for part in (ranges, rates))
    return Task(Sensors(*vehicles), int(views.target[b]) + 1)


@inlined
def new_view(form: Form, n: int) -> View:
    """What an attacker sees of one episode, not filled yet; kernels use it for one episode after the other."""
    slots = form.sensors.size
    return View(np.empty(2 * n), np.empty(slots, np.bool_), np.empty(1, np.int64), np.empty(1, np.int64))


@inlined
def look(form: Form, c: Constants, row: Observation, episode: View) -> None:
    """Fill a view from the observation (size,) of its episode."""
    at, scale, n = form.offsets[0], form.scale, episode.error.size // 2
    for j in range(2 * n):
        entry = at.gap_error + j if j < n else at.relative_speed + j - n
        value = decode_entry(row, scale, entry)
        episode.error[j] = 0.0 if abs(value) < AT_REST else value  # so that attacks start
    episode.step[0] = c.horizon - int(np.rint(decode_entry(row, scale, at.steps_left)))
    episode.target[0] = form.target[0]
    for slot in range(episode.attacked.size):
        episode.attacked[slot] = not c.draws or decode_entry(row, scale, at.attacked + slot) > 0.5
    if c.draws:
        for i in range(n):
            if row[at.target + i] > row[at.target + episode.target[0]]:
                episode.target[0] = i


@kernel
def _look(form: Form, observation: Observation, views: View) -> None:
    """Fill the views of observations (B, size)."""
    c = unpack(Constants, form.constants, 0)
    for b in range(observation.shape[0]):
        look(form, c, borrowed(observation)[b], view(views, b))
