"""An attacker that replans at every step with continuous injections and rounds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.continuation import best_from, fastest_from
from cps_baselines.fdi.injection import InjectionPolicy, View, task_of, view_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, State
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.task import Task

MOST_STEPS = 40
RESERVE = 1.0  # chosen: of 0, 0.25, 0.5, 0.75 and 1 the highest mean share of the optimum over the tasks of set A
NOTHING, TIGHT, RESERVED, HIT = range(4)  # prospects, from the worst to the best


class Prospect(NamedTuple):
    """How much a state promises the attacker: first how safe a collision is, then how fast."""

    rank: int
    speed_mps: float


LOST = Prospect(NOTHING, 0.0)


@plays_in("paper")
class LpGreedy(InjectionPolicy):
    """Plans the fastest continuous attack at every step, and injects its first value, rounded to a legal level.

    Each level is rounded down or up, whichever leaves the faster continuous attack; where none is left, nothing is
    injected. Linear programs instead of an integer one: a few milliseconds each, and no promise, since rounding wastes
    speed and can lose the collision. Attacks of at most `max_steps` steps are considered; from rest the longest of
    them alone will do, since waiting is free.

    `reserve` is the part of one level's effect on commands that plans keep from the limits: without it they need every
    bit of acceleration, which whole levels cannot give. Plans without reserve are used where there are no others.

    Raises:
        ConfigurationError: `max_steps` below 1 or a negative reserve.
    """

    exact = True

    def __init__(self, spec: RoleSpec, *, max_steps: int = MOST_STEPS, reserve: float = RESERVE) -> None:
        super().__init__(spec)
        if max_steps < 1 or reserve < 0:
            raise ConfigurationError(f"lp_greedy needs max_steps >= 1 and reserve >= 0, got {max_steps} and {reserve}")
        self.max_steps = max_steps
        self._configs = {RESERVED: with_reserve(self.config, reserve), TIGHT: self.config}

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """See the class."""
        view = view_of(self.form, seen)
        levels = np.zeros(view.attacked.shape, np.int64)
        for b in range(len(levels)):
            task, step = task_of(self.config, view, b), int(view.step[b])
            plan = self._plan(task, view.error[b], step)
            if plan is not None:
                levels[b] = self._rounded(plan, task, view, b)
        return self.say(view, levels, seen.masks), state

    def _plan(self, task: Task, error: FloatArray, step: int) -> FloatArray | None:
        """The levels (k, q) of the plan, with reserve if there is one."""
        for config in self._configs.values():
            plan = best_from(config, task, error, step, self._lengths(error, step))
            if plan is not None:
                return plan
        return None

    def _lengths(self, error: FloatArray, step: int) -> Sequence[int]:
        """The lengths of attacks that are considered."""
        longest = min(self.max_steps, self.config.horizon - step)
        return range(1, longest + 1) if error.any() else (longest,)

    def _rounded(self, plan: FloatArray, task: Task, view: View, b: int) -> IntArray:
        """The rounding (S,) of a plan's first injections that leaves the best prospect, the nearest of equal ones."""
        attacked = view.attacked[b]
        wish: FloatArray = np.zeros(len(attacked))
        wish[attacked] = plan[0]
        ways = np.array(list(product(*({int(np.floor(level)), int(np.ceil(level))} for level in wish))))
        errors = np.repeat(view.error[b : b + 1], len(ways), axis=0)
        rows = np.repeat(attacked[np.newaxis], len(ways), axis=0)
        _, levels = self.form.to_actions(errors, rows, ways)
        distance = np.abs(levels - wish).sum(axis=1).tolist()
        step = int(view.step[b]) + 1
        prospects = [self._prospect(task, self.form.error_after(view.error[b], way), step) for way in levels]
        best: IntArray = levels[max(range(len(ways)), key=lambda way: (prospects[way], -distance[way]))]
        return best

    def _prospect(self, task: Task, error: FloatArray, step: int) -> Prospect:
        """What can still be reached from e(step) = `error` (2n,)."""
        n, touch_m = self.config.num_vehicles, SLACK - self.config.desired_gap_m
        if np.any(error[:n] <= touch_m):
            target = task.target - 1
            return Prospect(HIT, max(0.0, -float(error[n + target]))) if error[target] <= touch_m else LOST
        if step < self.config.horizon:
            for rank, config in self._configs.items():
                best = fastest_from(config, task, error, step, self._lengths(error, step))
                if best is not None:
                    return Prospect(rank, best[0])
        return LOST


def with_reserve(config: FdiConfig, reserve: float) -> FdiConfig:
    """The configuration with limits of acceleration that are a part of the coarser level's effect narrower."""
    range_mps2 = config.proportional_gain * config.range_resolution_m
    rate_mps2 = config.derivative_gain * config.rate_resolution_mps
    margin_mps2 = reserve * max(range_mps2, rate_mps2)
    return replace(
        config,
        min_acceleration_mps2=config.min_acceleration_mps2 + margin_mps2,
        max_acceleration_mps2=config.max_acceleration_mps2 - margin_mps2,
    )
