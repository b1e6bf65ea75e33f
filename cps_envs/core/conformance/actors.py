"""Random but legal actions for any of the core's action spaces, from a generator that belongs to the checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from cps_envs.core.interfaces.agents_vector_env import AgentsVectorEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import Array

Info = Mapping[str, Any]


class Actor:
    """Draws actions of one space; `boldness` is the share of decisions that are not left neutral."""

    def __init__(self, space: spaces.Space[Any], neutral: Array, seed: Any, boldness: float = 0.7) -> None:
        self._space, self._neutral, self._boldness = space, np.asarray(neutral), boldness
        self._generator = np.random.default_rng(seed)

    def act(self, mask: Array | tuple[Array, ...] | None) -> Array:
        """An action that a mask of `info` allows; None allows all."""
        mask = flat(mask)
        bold, extreme = self._generator.random(2)
        if isinstance(self._space, spaces.Box):
            return self._force(bold < self._boldness, extreme < 0.3)
        chosen = self._choice(mask)
        neutral = self._neutral.astype(np.int64)
        use_neutral = bold >= self._boldness and allows(self._space, mask, neutral)
        return neutral if use_neutral else chosen

    def _force(self, bold: bool, extreme: bool) -> Array:
        assert isinstance(self._space, spaces.Box)
        share = self._generator.random(self._space.shape)
        if extreme:
            share = np.round(share)
        drawn = self._space.low + share * (self._space.high - self._space.low)
        action: Array = (drawn if bold else self._neutral).astype(self._space.dtype)
        return action

    def _choice(self, mask: Array | None) -> Array:
        starts, counts = _start_and_counts(self._space)
        legal = np.ones(sum(counts), np.bool_) if mask is None else np.asarray(mask, np.bool_)
        shares = self._generator.random(len(counts))
        chosen = []
        for part, share in zip(np.split(legal, np.cumsum(counts)[:-1]), shares, strict=True):
            options = np.flatnonzero(part)
            chosen.append(options[int(share * len(options))])
        action = np.array(chosen) + starts
        return action.reshape(self._space.shape or ())


def flat(mask: Array | tuple[Array, ...] | None) -> Array | None:
    """A mask (k,) of `info`, whose parts for MultiDiscrete are put one behind the other."""
    return np.concatenate(mask) if isinstance(mask, tuple) else mask


def _start_and_counts(space: Any) -> tuple[Array, list[int]]:
    if isinstance(space, spaces.Discrete):
        return np.array([space.start]), [int(space.n)]
    return np.ravel(space.start), np.ravel(space.nvec).tolist()


def allows(space: Any, mask: Array | None, action: Array) -> bool:
    """Whether `mask` (k,) marks an action of a Discrete or MultiDiscrete space as legal."""
    if mask is None:
        return True
    starts, counts = _start_and_counts(space)
    offsets = np.cumsum([0, *counts[:-1]])
    return bool(np.asarray(mask)[offsets + np.ravel(action) - starts].all())


class Crew:
    """The actors of an environment of any interface, one for each environment or agent."""

    def __init__(self, env: Any, seed: int = 0, boldness: float = 0.7) -> None:
        self._env = env
        self._actors = [Actor(space, neutral, [seed, i], boldness) for i, (space, neutral) in enumerate(_seats(env))]

    def act(self, info: Info) -> Any:
        """Actions in the form that the environment's `step` takes, legal by the last info."""
        env = self._env
        if isinstance(env, RoleVectorEnv):
            masks = info.get("action_mask", [None] * env.num_envs)
            return np.stack([actor.act(mask) for actor, mask in zip(self._actors, masks, strict=True)])
        if isinstance(env, ParallelEnv):
            agents = zip(env.possible_agents, self._actors, strict=True)
            return {agent: actor.act(info[agent].get("action_mask")) for agent, actor in agents}
        if isinstance(env, AgentsVectorEnv):
            return {agent: self._all(i, info.get(agent, {})) for i, agent in enumerate(env.possible_agents)}
        return self._actors[0].act(info.get("action_mask"))

    def _all(self, agent: int, shown: Info) -> Array:
        """The actions (B, ...) of an agent in all episodes."""
        count = self._env.num_envs
        masks = shown.get("action_mask", [None] * count)
        actors = self._actors[agent * count : (agent + 1) * count]
        return np.stack([actor.act(mask) for actor, mask in zip(actors, masks, strict=True)])


def _seats(env: Any) -> list[tuple[Any, Array]]:
    """Action space and neutral action of each environment or agent, or of each agent in each environment."""
    if isinstance(env, RoleVectorEnv):
        return [(env.single_action_space, env.neutral_action)] * env.num_envs
    if hasattr(env, "possible_agents"):
        count = env.num_envs if isinstance(env, AgentsVectorEnv) else 1
        agents = [agent for agent in env.possible_agents for _ in range(count)]
        return [(env.action_space(agent), env.neutral_action(agent)) for agent in agents]
    return [(env.action_space, env.neutral_action)]
