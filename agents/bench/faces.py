"""The environments to be measured: each face of each id, and Gymnasium's CartPole in the same forms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import cycle
from typing import Any

import gymnasium
import numpy as np

from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.problem import Problem
from cps_envs.core.types import AGENTS, ROLES

CARTPOLE = "CartPole-v1"
NUM_ENVS = (1, 64, 1024)
ACTIONS = 64  # drawn beforehand, so that drawing them is not measured


@dataclass(frozen=True)
class Face:
    """Something with a step to be timed."""

    env: str
    form: str  # single, vector or parallel
    envs: int
    start: Callable[[], Callable[[], object]]  # makes and resets the environment; returns its step
    decisions: float = 1.0  # of the roles played from outside, per step and environment
    work: float = 0.0  # units of physics per step and environment


def cartpole() -> Iterator[Face]:
    """The yardstick."""
    yield Face(CARTPOLE, "single", 1, lambda: single(CARTPOLE))
    for envs in NUM_ENVS:
        yield Face(CARTPOLE, "vector", envs, lambda envs=envs: vector(CARTPOLE, envs))  # type: ignore[misc]


def faces(problem: Problem) -> Iterator[Face]:
    """Every face of a problem under the preset `paper`."""
    game = problem.game(problem.presets["paper"], 1)
    work = work_per_game_step(problem, game.config)
    for role in ROLES:
        env_id, done = problem.env_id(role), work * game.decision_interval[role]
        yield Face(env_id, "single", 1, lambda env_id=env_id: single(env_id), work=done)  # type: ignore[misc]
        for envs in NUM_ENVS:
            start = lambda env_id=env_id, envs=envs: vector(env_id, envs)  # noqa: E731
            yield Face(env_id, "vector", envs, start, work=done)
    decisions = sum(1.0 / game.decision_interval[role] for role in ROLES)
    name = f"{problem.namespace}/{problem.name}-v{problem.version}"
    yield Face(name, "parallel", 1, lambda: parallel(problem), decisions, work)


def work_per_game_step(problem: Problem, config: Any) -> float:
    """Units of physics per game step and environment; 0 where the problem names none."""
    return 0.0 if problem.work is None else problem.work.per_game_step(config)


def moves(space: Any, neutral: Any) -> Iterator[Any]:
    """Random actions; only the neutral one of a role that has illegal ones, which could end an episode."""
    space.seed(0)
    return cycle([space.sample() if neutral is None else neutral for _ in range(ACTIONS)])


def single(env_id: str) -> Callable[[], object]:
    """A step of `gymnasium.make(id)`, with a reset where an episode has ended."""
    env = gymnasium.make(env_id)
    _, info = env.reset(seed=0)
    game, role = getattr(env.unwrapped, "game", None), getattr(env.unwrapped, "role", None)
    actions = moves(env.action_space, game.neutral_action[role] if game and "action_mask" in info else None)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    return step


def vector(env_id: str, num_envs: int) -> Callable[[], object]:
    """A step of the native vector form."""
    envs: Any = gymnasium.make_vec(env_id, num_envs=num_envs, vectorization_mode="vector_entry_point")
    _, info = envs.reset(seed=0)
    masked = "action_mask" in info
    actions = moves(envs.action_space, np.stack([envs.game.neutral_action[envs.role]] * num_envs) if masked else None)
    return lambda: envs.step(next(actions))


def parallel(problem: Problem) -> Callable[[], object]:
    """A step of the PettingZoo form."""
    env = RolesParallelEnv(problem)
    _, infos = env.reset(seed=0)
    draws = {}
    for role, agent in AGENTS.items():
        neutral = env.game.neutral_action[role] if "action_mask" in infos[agent] else None
        draws[agent] = moves(env.action_space(agent), neutral)

    def step() -> None:
        env.step({agent: next(draw) for agent, draw in draws.items()})
        if not env.agents:
            env.reset()

    return step
