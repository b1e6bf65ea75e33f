"""The strongest attacker: plays the certified optimum of its task by the clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from baselines.fdi.action_form import Pick
from baselines.fdi.injection import InjectionPolicy, View, wished
from cps_envs.core.errors import ConfigurationError, require
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.types import BoolArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import Record, known, known_within
from cps_envs.fdi.selection import chosen_tasks
from cps_envs.fdi.task import Task

MOST_INTEGERS = 60  # horizon times sensors up to which an optimum is searched for when a policy is made
SEARCH_S = 5.0
WHOLE = 1e-9  # levels


class Replay(InjectionPolicy):
    """Open loop: the shipped optimum of the episode's task, whatever happens meanwhile.

    In undisturbed, undefended episodes it attains the highest speed known, which is the optimum where the certificate
    is closed; otherwise it is a fixed, strong attack. It plays optima of a shorter horizon where there are none of
    this one, and tasks without any shipped optimum are solved once, as far as `time_limit_s` allows.

    `start` is the number of steps waited first, or "random": drawn for each episode so that the plan still fits.

    Raises:
        ConfigurationError: a task that cannot succeed, or one whose optimum takes too long to find here.
    """

    def __init__(self, spec: RoleSpec, *, start: int | str = 0, time_limit_s: float = SEARCH_S) -> None:
        super().__init__(spec, legal=False)
        if start != "random" and not (isinstance(start, int) and start >= 0):
            raise ConfigurationError(f'start = {start!r} must be a number of steps, 0 or more, or "random"')
        self.start = start
        tasks = chosen_tasks(self.config)
        plans = [plan_of(self.config, task, time_limit_s) for task in tasks]
        self.steps = max(len(plan) for plan in plans)
        self._levels = np.stack([self._placed(task, plan) for task, plan in zip(tasks, plans, strict=True)])
        n = self.config.num_vehicles
        flags = np.stack([task.sensors.flags(n) for task in tasks])
        targets = np.array([task.target - 1 for task in tasks])
        keys = self._key(flags[:, self.form.sensors], targets)
        self._order = np.argsort(keys)
        self._keys = keys[self._order]

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """The step (B,) at which each episode's plan starts."""
        return (np.array([self._onset(generator) for generator in generators]),)

    def choose(self, view: View, state: State) -> tuple[Pick, State]:
        """See the class."""
        assert state is not None
        tasks = self._order[np.searchsorted(self._keys, self._key(view.attacked, view.target))]
        step = view.step - state[0]
        playing = (step >= 0) & (step < self.steps)
        levels = self._levels[tasks, np.where(playing, step, 0)]
        levels = np.where(playing[:, np.newaxis], levels, 0)
        return self._said(levels, view) if self.form.share_levels else wished(levels), state

    def _said(self, levels: IntArray, view: View) -> Pick:
        """Levels (B, S) for the form "share", which cannot say every range while the range-rate is attacked too.

        Of a vehicle's injections only k_p d_x + k_d d_v counts: the nearest range that can be said is taken with the
        range-rate that leaves this sum as it is. There is not always one, and then this is no replay any more.
        """
        config, taken, slots = self.config, levels.copy(), self.form.sensors.tolist()
        rate_mps2 = config.derivative_gain * config.rate_resolution_mps
        envs, ratio = np.arange(len(levels)), config.proportional_gain * config.range_resolution_m / rate_mps2

        def pick(slot: int, low: IntArray, high: IntArray) -> IntArray:
            partner = slots[slot] + config.num_vehicles
            if partner in slots:
                rate = slots.index(partner)
                ranges = self.form.sayable(low, high)
                change = ratio * (levels[:, [slot]] - ranges)
                rates = levels[:, [rate]] + np.rint(change).astype(np.int64)
                fits = (np.abs(change - np.rint(change)) < WHOLE) & (np.abs(rates) <= self.form.bounds[rate])
                best = np.argmin(np.where(fits, np.abs(levels[:, [slot]] - ranges), np.inf), axis=1)
                both = view.attacked[:, slot] & view.attacked[:, rate] & fits[envs, best]
                taken[both, slot], taken[both, rate] = ranges[envs, best][both], rates[envs, best][both]
            return taken[:, slot]

        return pick

    def _onset(self, generator: np.random.Generator) -> int:
        drawn = int(generator.integers(max(self.config.horizon - self.steps, 0) + 1))
        return drawn if isinstance(self.start, str) else self.start

    def _placed(self, task: Task, plan: IntArray) -> IntArray:
        """A plan (k, q) as levels (steps, S) that ends like the longest one."""
        slots = np.flatnonzero(task.sensors.flags(self.config.num_vehicles)[self.form.sensors])
        levels = np.zeros((self.steps, len(self.form.sensors)), np.int64)
        levels[self.steps - len(plan) :, slots] = plan
        return levels

    def _key(self, attacked: BoolArray, target: IntArray) -> IntArray:
        """One number (T,) for each combination of attacked slots (T, S) and target (T,)."""
        bits: IntArray = attacked @ (1 << np.arange(len(self.form.sensors), dtype=np.int64))
        return bits * self.config.num_vehicles + target


def plan_of(config: FdiConfig, task: Task, time_limit_s: float = SEARCH_S) -> IntArray:
    """The levels (k, q) of the fastest known attack: shipped, or else found now.

    Raises:
        ConfigurationError: the target is known to be out of reach, nothing was found in time, or it would take too
            long.
    """
    shipped = known(config).get(task) or known_within(config).get(task)
    exact = task in known(config)
    if shipped is not None and shipped.injections is not None:
        return shipped.injections
    record = shipped if exact and shipped is not None and shipped.closed else _solved(config, task, time_limit_s)
    if record.injections is None:
        raise ConfigurationError(
            f"no attack on {task.sensors} makes vehicle {task.target} collide within {config.horizon} steps "
            f"({record.status}). Choose another task, or an attacker that needs no optimum, such as random."
        )
    return record.injections


@lru_cache(maxsize=256)
def _solved(config: FdiConfig, task: Task, time_limit_s: float) -> Record:
    integers = config.horizon * task.sensors.count
    if integers > MOST_INTEGERS:
        raise ConfigurationError(
            f"no optimum of {task} with these constants and {config.horizon} steps is shipped, and one with {integers} "
            f"integers is not found in passing (at most {MOST_INTEGERS}). Use the shipped constants or a shorter "
            "horizon, find optima with `cps-envs oracle`, or choose another attacker, such as bnb."
        )
    require("highspy", extra="baselines", purpose=f"finding the optimum of {task}, which is not shipped,")
    from baselines.fdi.cross import cross  # needs scipy; shipped optima do not

    return cross(config, task, time_limit_s)
