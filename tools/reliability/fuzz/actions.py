"""Actions of every kind for the single, the parallel and the vector interface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from cps_envs import PROBLEMS, find_problem
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.types import ROLES, Role
from tools.reliability.chunk import Chunk
from tools.reliability.fuzz.judging import Tally, wrong_numbers
from tools.reliability.fuzz.values import Generator, Named, legal_batch, odd_value, spoilt_batch

PRESETS = ("learning", "paper")
SINGLE, PARALLEL = 20_000, 10_000  # inputs of a chunk
BATCH, BATCHES = 256, 500
SPOILT = 0.6  # of the actions of one environment
SPOILT_BATCHES = 0.2


def seat(number: int) -> tuple[Problem, Role, str]:
    """Problem, role and preset of a chunk."""
    names = sorted(PROBLEMS)
    problem, role = find_problem(names[number % len(names)]), ROLES[number // len(names) % 2]
    return problem, role, PRESETS[number // (2 * len(names)) % 2]


def single(chunk: Chunk, tally: Tally) -> None:
    """One action after the other, through `gymnasium.make`'s own environment without its checker."""
    problem, role, preset = seat(chunk.number)
    env: Any = gymnasium.make(problem.env_id(role), preset=preset, disable_env_checker=True).unwrapped
    rng = np.random.default_rng(chunk.number)
    env.reset(seed=chunk.number)

    def act(action: Any) -> str | None:
        before = env.game.elapsed.copy()
        try:
            observation, reward, terminated, truncated, _ = env.step(action)
        except Exception:
            if (env.game.elapsed != before).any():
                return "a refused action moved the game"
            raise
        if terminated or truncated:
            env.reset()
        return wrong_numbers(observation, reward)

    for _ in range(SINGLE):
        what, action = _one(env.action_space, rng)
        tally.attempt(f"{problem.name} {role} {preset} {what}", lambda action=action: act(action))  # type: ignore[misc]


def _one(space: Any, rng: Generator) -> Named:
    action = legal_batch(space, 1, rng)[0]
    if rng.random() >= SPOILT:
        return "legal", action if action.shape else int(action)
    return spoilt_batch(np.asarray(action), rng)


def parallel(chunk: Chunk, tally: Tally) -> None:
    """Dictionaries of actions, some of them without an agent or with a stranger."""
    problem, _, preset = seat(chunk.number)
    env = RolesParallelEnv(problem, preset=preset)
    rng = np.random.default_rng([chunk.number, 1])
    env.reset(seed=chunk.number)

    def act(actions: Any) -> str | None:
        observations, rewards, *_ = env.step(actions)
        if not env.agents:
            env.reset()
        found = (wrong_numbers(observations[agent], rewards[agent]) for agent in observations)
        return next((wrong for wrong in found if wrong), None)

    for _ in range(PARALLEL):
        what, actions = _both(env, rng)
        tally.attempt(f"{problem.name} {preset} {what}", lambda actions=actions: act(actions))  # type: ignore[misc]


def _both(env: RolesParallelEnv, rng: Generator) -> Named:
    drawn = {agent: _one(env.action_space(agent), rng) for agent in env.possible_agents}
    actions: Any = {agent: value for agent, (_, value) in drawn.items()}
    what = ", ".join(name for name, _ in drawn.values())
    kind = rng.random()
    if kind < 0.05:
        actions.pop(env.possible_agents[0])
        return f"{what}, one agent missing", actions
    if kind < 0.1:
        actions["stranger"] = 0
        return f"{what}, a stranger", actions
    return odd_value(rng) if kind < 0.15 else (what, actions)


def vector(chunk: Chunk, tally: Tally) -> None:
    """Batches of actions. Each row of an accepted batch is an input, a refused batch is one."""
    problem, role, preset = seat(chunk.number)
    env: Any = gymnasium.make_vec(problem.env_id(role), num_envs=BATCH, preset=preset)
    rng = np.random.default_rng([chunk.number, 2])
    env.reset(seed=chunk.number)

    def act(actions: Any) -> str | None:
        observation, rewards, terminated, truncated, _ = env.step(actions)
        if terminated.dtype != np.bool_ or truncated.dtype != np.bool_:
            return "the ends are no truth values"
        return wrong_numbers(observation, rewards)

    for _ in range(BATCHES):
        actions: Any = legal_batch(env.single_action_space, BATCH, rng)
        what = "legal"
        if rng.random() < SPOILT_BATCHES:
            what, actions = spoilt_batch(actions, rng)
        trial = lambda actions=actions: act(actions)  # noqa: E731
        tally.attempt(f"{problem.name} {role} {preset} {what}", trial, BATCH)


ROWS: Sequence[str] = ("actions, one environment", "actions, both roles", "actions, vector of 256")
