"""The strongest attacker: plays the certified optimum of its task by the clock."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.action_form import Form, new_slots, open_slots, take
from cps_baselines.fdi.injection import InjectionPolicy, look, new_view
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, kernel, lend, unpack
from cps_envs.core.errors import ConfigurationError, require
from cps_envs.core.policies.policy import RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import Record, known, known_within
from cps_envs.fdi.selection import chosen_tasks
from cps_envs.fdi.state import Constants
from cps_envs.fdi.task import Task

MOST_INTEGERS = 60  # horizon times sensors up to which an optimum is searched for when a policy is made
SEARCH_S = 5.0


@plays_in("paper")
class Replay(InjectionPolicy):
    """Plays the shipped optimum of the episode's task, whatever happens meanwhile.

    In undisturbed, undefended episodes it attains the highest speed known, which is the optimum where the certificate
    is closed; otherwise it is a fixed, strong attack. It plays optima of a shorter horizon where there are none of
    this one, and tasks without any shipped optimum are solved once, as far as `time_limit_s` allows.

    `start` is the number of steps waited first, or "random": drawn for each episode so that the plan still fits.

    Raises:
        ConfigurationError: a task that cannot succeed, or one whose optimum takes too long to find here.
    """

    exact = True

    def __init__(self, spec: RoleSpec, *, start: int | str = 0, time_limit_s: float = SEARCH_S) -> None:
        super().__init__(spec, legal=False)
        if start != "random" and not (isinstance(start, int) and start >= 0):
            raise ConfigurationError(f'start = {start!r} must be a number of steps, 0 or more, or "random"')
        self.start = start
        tasks = chosen_tasks(self.config)
        plans = [plan_of(self.config, task, time_limit_s) for task in tasks]
        self.steps = max(len(plan) for plan in plans)
        levels = np.stack([self._placed(task, plan) for task, plan in zip(tasks, plans, strict=True)])
        n = self.config.num_vehicles
        flags = np.stack([task.sensors.flags(n) for task in tasks])
        targets = np.array([task.target - 1 for task in tasks])
        keys = self._key(flags[:, self.form.sensors], targets)
        order = np.argsort(keys)
        self._plans = hold(Plans(levels, keys[order], order))

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The step (B,) at which each episode's plan starts."""
        if not isinstance(self.start, str):
            return (np.full(len(generators), self.start),)
        return (np.array([self._onset(generator) for generator in generators]),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S), see the class."""
        actions = np.empty((len(seen), len(self.form.sensors)), np.int64)
        _play(self.form.held, self._plans, seen.observation, state[0], actions)
        return actions, state

    def _onset(self, generator: np.random.Generator) -> int:
        return int(generator.integers(max(self.config.horizon - self.steps, 0) + 1))

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


class Plans(NamedTuple):
    """The known best plans of T tasks."""

    levels: IntArray  # (T, k, S)
    keys: IntArray  # (T,) of the tasks, sorted
    order: IntArray  # (T,) the tasks that they belong to


@kernel
def _play(form: Form, plans: Plans, observation: Observation, onsets: IntArray, actions: IntArray) -> None:
    """Fill the actions (B, S) for observations (B, size); the plans begin at the `onsets` (B,)."""
    c, n = unpack(Constants, form.constants, 0), form.matrices.step.shape[1] // 2
    new, shown = new_slots(form, n), new_view(form, n)
    for b in range(actions.shape[0]):
        episode = lend(shown)
        look(form, c, borrowed(observation)[b], episode)
        slots, step, key = open_slots(form, episode.attacked, new), episode.step[0] - onsets[b], episode.target[0]
        for slot in range(form.sensors.size):
            key += n * (episode.attacked[slot] << slot)
        task = plans.order[min(np.searchsorted(plans.keys, key), plans.keys.size - 1)]
        for slot in range(form.sensors.size):
            wish = plans.levels[task, step, slot] if 0 <= step < plans.levels.shape[1] else 0
            actions[b, slot] = take(form, slots, slot, wish)


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
            "horizon, find optima with `cps-envs certify`, or choose another attacker, such as bnb."
        )
    require("highspy", extra="baselines", purpose=f"finding the optimum of {task}, which is not shipped,")
    from cps_baselines.fdi.cross import cross  # needs scipy; shipped optima do not

    return cross(config, task, time_limit_s)
