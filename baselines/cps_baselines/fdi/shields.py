"""Shields: they let an attacker's injection pass only if the episode can go on legally afterwards.

What is legal now says nothing about the next steps: commands of vehicles that nobody attacks follow from the state
alone. Both shields look to the end of the episode, on the undisturbed model with hard limits. For learners a shield
goes around the attacker's environment.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from itertools import product
from typing import Any

import gymnasium
import numpy as np

from cps_baselines.fdi.action_form import ActionForm
from cps_baselines.fdi.continuation import integer_continuation, legal_continuation
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.types import BoolArray, FloatArray, IntArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.task import Task

TRIES = 60  # levels that a shield looks at before it gives up
REACH = 1000  # neighbours that are sorted to find the nearest


class Shield(ABC):
    """Decides on the levels of one episode, state by state.

    Raises:
        ConfigurationError: clipped limits, under which nothing is illegal.
    """

    by_example = False  # whether an example of going on legally is enough, see `calming`
    plans = False  # whether `allow` hands plans on

    def __init__(self, config: FdiConfig, time_limit_s: float = 1.0) -> None:
        if config.limits == "clip":
            raise ConfigurationError('a shield needs limits="hard"; with limits="clip" every injection is legal')
        self.config, self.form, self.time_limit_s = config, ActionForm(config), time_limit_s

    @abstractmethod
    def allow(
        self, task: Task, error: FloatArray, step: int, wish: IntArray, kept: IntArray
    ) -> tuple[IntArray, IntArray]:
        """What to inject instead of `wish` (S,), and a plan (k, S) for the steps after it.

        `error` (2n,) is e(step), `kept` the plan of the call before; (0, S) where there is none, as at the start.
        """

    def _legal(self, task: Task, error: FloatArray, wishes: IntArray) -> IntArray:
        """The nearest levels (W, S) that are legal in this step, each once."""
        attacked = self._attacked(task)
        errors, rows = np.tile(error, (len(wishes), 1)), np.tile(attacked, (len(wishes), 1))
        _, levels = self.form.to_actions(errors, rows, wishes)
        return np.array(list(dict.fromkeys(map(tuple, levels.tolist()))), np.int64)

    def _attacked(self, task: Task) -> BoolArray:
        """The slots (S,) of a task."""
        flags: BoolArray = task.sensors.flags(self.config.num_vehicles)[self.form.sensors]
        return flags

    def _over(self, error: FloatArray) -> bool:
        """Whether a pair has collided, which ends the episode."""
        return bool(np.any(error[: self.config.num_vehicles] <= SLACK - self.config.desired_gap_m))


class LpShield(Shield):
    """Takes the nearest levels after which continuous injections can go on legally.

    What it forbids is a certain dead end. What it allows may still be one for whole levels, and where it finds nothing
    it lets the nearest legal levels pass: it makes dead ends rare, not impossible.
    """

    by_example = True  # it tells as much as a linear program, and sooner

    def allow(
        self, task: Task, error: FloatArray, step: int, wish: IntArray, kept: IntArray
    ) -> tuple[IntArray, IntArray]:
        """See `Shield.allow`; no plan is kept."""
        nearest = self._legal(task, error, wish[np.newaxis])[0]
        for levels in self._candidates(task, error, nearest):
            after = self.form.error_after(error, levels)
            if self._over(after) or legal_continuation(self.config, task, after, step + 1):
                return levels, kept[:0]
        return nearest, kept[:0]

    def _candidates(self, task: Task, error: FloatArray, wish: IntArray) -> Iterator[IntArray]:
        """Legal levels (S,), the nearest first."""
        yield wish
        attacked = self._attacked(task)
        count = int(attacked.sum())
        radius = max(1, int(REACH ** (1 / count) - 1) // 2)
        offsets = np.array(sorted(product(range(-radius, radius + 1), repeat=count), key=_length)[1:])
        wishes = np.tile(wish, (len(offsets), 1))
        wishes[:, attacked] += offsets
        yield from self._legal(task, error, wishes)[:TRIES]


class SoundShield(Shield):
    """Lets levels pass only when it holds whole levels with which the episode goes on legally to its end.

    Otherwise it plays the plan that it holds. From a start at rest, with hard limits, no disturbance and no defender
    that acts, no episode ends illegally. It forbids what it cannot prove within `time_limit_s`, so how much it
    forbids depends on the machine.
    """

    plans = True

    def allow(
        self, task: Task, error: FloatArray, step: int, wish: IntArray, kept: IntArray
    ) -> tuple[IntArray, IntArray]:
        """See `Shield.allow`."""
        levels = self._legal(task, error, wish[np.newaxis])[0]
        if len(kept) and np.array_equal(levels, kept[0]):
            return levels, kept[1:]
        after = self.form.error_after(error, levels)
        plan = self._plan(task, after, step + 1)
        if plan is not None:
            return levels, plan
        if not len(kept):
            kept = self._first_plan(task, error, step)
        return (kept[0], kept[1:]) if len(kept) else (levels, kept)

    def _first_plan(self, task: Task, error: FloatArray, step: int) -> IntArray:
        """A plan from a state for which none is held: waiting where the platoon is at rest; empty if none is found."""
        slots = len(self.form.sensors)
        if not error.any():
            return np.zeros((self.config.horizon - step, slots), np.int64)
        plan = self._plan(task, error, step)
        return np.zeros((0, slots), np.int64) if plan is None else plan

    def _plan(self, task: Task, error: FloatArray, step: int) -> IntArray | None:
        """Levels (k, S) that go on legally; none are needed after a collision."""
        slots = len(self.form.sensors)
        if self._over(error):
            return np.zeros((0, slots), np.int64)
        found = integer_continuation(self.config, task, error, step, self.time_limit_s)
        if found is None:
            return None
        plan = np.zeros((len(found), slots), np.int64)
        plan[:, self._attacked(task)] = found
        return plan


SHIELDS: dict[str, type[Shield]] = {"lp": LpShield, "sound": SoundShield}


def make_shield(kind: str, config: FdiConfig, time_limit_s: float = 1.0) -> Shield:
    """The shield "lp" or "sound".

    Raises:
        ConfigurationError: no such shield, or one that is not needed.
    """
    if kind not in SHIELDS:
        raise ConfigurationError(f"there is no shield {kind!r}. {near(kind, SHIELDS)}")
    return SHIELDS[kind](config, time_limit_s)


def _length(offset: tuple[int, ...]) -> int:
    return sum(map(abs, offset))


class ShieldedInjection(gymnasium.Wrapper[Observation, Any, Observation, Any]):
    """`FdiAttackEnv` whose actions pass a shield, "lp" or "sound", that knows the true state.

    `info["shielded"]` is 1.0 where something else was injected than asked for.

    Raises:
        ConfigurationError: not an attacker's environment of this problem, no such shield, or clipped limits.
    """

    def __init__(self, env: gymnasium.Env[Observation, Any], kind: str = "lp", time_limit_s: float = 1.0) -> None:
        super().__init__(env)
        unwrapped: Any = env.unwrapped
        game = getattr(unwrapped, "game", None)
        if not isinstance(game, FdiGame) or unwrapped.role != "attacker":
            raise ConfigurationError("ShieldedInjection wraps the environment FdiAttack")
        self.game: FdiGame = game
        self.shield = make_shield(kind, game.config, time_limit_s)
        self._kept = self._nothing()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode."""
        self._kept = self._nothing()
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, {**info, "shielded": 0.0}

    def step(self, action: Any) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Advance by one decision."""
        game, form = self.game, self.shield.form
        task = game.tasks[game.state.task[0]]
        attacked = task.sensors.flags(game.config.num_vehicles)[form.sensors][np.newaxis]
        error = game.state.error[0].copy()
        wish = form.to_levels(error[np.newaxis], attacked, np.asarray(action)[np.newaxis])
        levels, self._kept = self.shield.allow(task, error, int(game.state.step[0]), wish[0], self._kept)
        actions, injected = form.to_actions(error[np.newaxis], attacked, levels[np.newaxis])
        observation, reward, terminated, truncated, info = self.env.step(actions[0])
        shielded = float(not np.array_equal(injected, wish))
        return observation, reward, terminated, truncated, {**info, "shielded": shielded}

    def _nothing(self) -> IntArray:
        return np.zeros((0, len(self.shield.form.sensors)), np.int64)
