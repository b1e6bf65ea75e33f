"""The physics without any face, and what the single environment adds to it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding

from agents.bench.faces import ACTIONS, work_per_game_step
from cps_envs.core.actions import ActionReader
from cps_envs.core.problem import Problem
from cps_envs.core.types import Role

WARM_SHARE = 0.1  # of an episode that the preset's opponents play before the clock starts
CHUNK = 50  # decisions between two looks at the clock


def physics_per_s(problem: Problem, lanes: int, seconds: float) -> float:
    """Units of physics per CPU second of `lanes` episodes in the thick of the preset `paper`'s own attack."""
    config = problem.presets["paper"]
    everyone = np.ones(lanes, np.bool_)
    match = problem.match(config, lanes, problem.opponents["paper"])
    game = match.game
    warm = max(1, round(WARM_SHARE * game.horizon))
    done = work_per_game_step(problem, config) * (game.horizon - warm) * lanes
    spent, best = 0.0, 0.0
    while spent < seconds:
        match.reset(everyone, [seeding.np_random(lane)[0] for lane in range(lanes)])
        match.step({}, everyone, warm)
        start = time.process_time()
        game.advance({}, everyone, game.horizon - warm)
        last = time.process_time() - start
        spent, best = spent + last, max(best, done / last)
    return best


def face_overhead_us(problem: Problem, role: Role, seconds: float) -> tuple[float, float]:
    """Microseconds of CPU per decision: what `Env.step` adds to `Game.advance` for the same work, and that work itself.

    Both go through the same episode in turns, a few decisions each; the median difference counts.
    """
    env, bare = _stepper(problem, role), _bare_stepper(problem, role)
    added: list[float] = []
    work: list[float] = []
    start = time.process_time()
    while time.process_time() - start < seconds or len(added) < 3:
        alone = _time(bare)
        added.append(_time(env) - alone)
        work.append(alone)
    return float(np.median(added)) * 1e6 / CHUNK, float(np.median(work)) * 1e6 / CHUNK


def _time(call: Callable[[], None]) -> float:
    start = time.process_time()
    for _ in range(CHUNK):
        call()
    return time.process_time() - start


def _actions(space: Any) -> list[Any]:
    space.seed(0)
    return [space.sample() for _ in range(ACTIONS)]


def _stepper(problem: Problem, role: Role) -> Callable[[], None]:
    env: Any = gymnasium.make(problem.env_id(role), opponent="none").unwrapped
    actions, count = _actions(env.action_space), 0
    env.reset(seed=0)

    def step() -> None:
        nonlocal count
        _, _, terminated, truncated, _ = env.step(actions[count % ACTIONS])
        count += 1
        if terminated or truncated:
            env.reset(seed=0)
            count = 0

    return step


def _bare_stepper(problem: Problem, role: Role) -> Callable[[], None]:
    game, lane = problem.game(problem.presets["paper"], 1), np.ones(1, np.bool_)
    reader = ActionReader(game.action_space[role])
    actions, count = [reader.single(action) for action in _actions(game.action_space[role])], 0
    interval = game.decision_interval[role]
    game.reset(lane, [seeding.np_random(0)[0]])

    def step() -> None:
        nonlocal count
        game.advance({role: actions[count % ACTIONS]}, lane, interval)
        count += 1
        if game.terminated[0] or game.elapsed[0] >= game.horizon:
            game.reset(lane, [seeding.np_random(0)[0]])
            count = 0

    return step
