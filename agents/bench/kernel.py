"""The physics without any face, and what the single environment adds to it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding

from agents.bench.faces import work_per_game_step
from cps_envs.core.problem import Problem
from cps_envs.core.types import Role

WARM_SHARE = 0.1  # of an episode that the preset's opponents play before the clock starts
CHUNK = 50  # decisions between two looks at the clock, if an episode has so many


def physics_per_s(problem: Problem, envs: int, seconds: float) -> float:
    """Units of physics per CPU second of `environments` episodes in the thick of the preset `paper`'s own attack."""
    config = problem.presets["paper"]
    everyone = np.ones(envs, np.bool_)
    match = problem.match(config, envs, problem.opponents["paper"])
    game = match.game
    warm = max(1, round(WARM_SHARE * game.horizon))
    done = work_per_game_step(problem, config) * (game.horizon - warm) * envs
    spent, best = 0.0, 0.0
    while spent < seconds:
        match.reset(everyone, [seeding.np_random(b)[0] for b in range(envs)])
        match.step({}, everyone, warm)
        start = time.process_time()
        game.advance({}, everyone, game.horizon - warm)
        last = time.process_time() - start
        spent, best = spent + last, max(best, done / last)
    return best


def face_overhead_us(problem: Problem, role: Role, seconds: float) -> tuple[float, float]:
    """Microseconds per decision of the single environment: outside the game's own advance and observe, and in them.

    The game's two methods are timed inside the environment's step, so that both figures come from the same calls; the
    median over the beginnings of many episodes, of neutral decisions, counts.
    """
    env: Any = gymnasium.make(problem.env_id(role), opponent="none").unwrapped
    inside = Stopwatch()
    own = 2 * inside.cost_ns()  # two methods are timed in each decision
    env.game.advance, env.game.observe = inside.timed(env.game.advance), inside.timed(env.game.observe)
    neutral = env.game.neutral_action[role]
    decisions = min(CHUNK, env.game.horizon // env.game.decision_interval[role])
    added: list[float] = []
    work: list[float] = []
    start = time.process_time()
    while time.process_time() - start < seconds or len(added) < 3:
        env.reset(seed=0)
        inside.total_ns, begin = 0, time.perf_counter_ns()
        for _ in range(decisions):
            env.step(neutral)
        whole = time.perf_counter_ns() - begin
        added.append((whole - inside.total_ns) / decisions - own)
        work.append(inside.total_ns / decisions)
    return float(np.median(added)) / 1e3, float(np.median(work)) / 1e3


class Stopwatch:
    """Adds up the time that some functions take."""

    def __init__(self) -> None:
        self.total_ns = 0

    def cost_ns(self, calls: int = 10_000) -> float:
        """What timing a call adds outside the time that is counted."""
        nothing = self.timed(lambda: None)
        begin = time.perf_counter_ns()
        for _ in range(calls):
            nothing()
        return (time.perf_counter_ns() - begin - self.total_ns) / calls

    def timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, with its time added to the total."""

        def call(*args: Any) -> Any:
            begin = time.perf_counter_ns()
            result = function(*args)
            self.total_ns += time.perf_counter_ns() - begin
            return result

        return call
