"""A policy that draws its actions."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State


class Uniform(AnalyticPolicy):
    """Draws every action from all that are legal: `random`, or `random?adapter=motion`.

    Raises:
        UnknownNameError: the role has no such adapter.
    """

    masked = True

    def __init__(self, spec: RoleSpec, *, adapter: str = NATIVE) -> None:
        super().__init__(spec)
        self._adapter = adapter_of(spec, adapter)
        self.decentralised = self._adapter.local
        self._choices = choices_of(self._adapter.action_space)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Each episode's generator, and what the adapter remembers."""
        own = np.empty(len(generators), object)
        own[:] = generators
        return own, *self._adapter.begin(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Drawn actions of all agents."""
        generators, *memory = state
        agents, space = len(self._adapter.agents), self._adapter.action_space
        shape = (len(seen), agents, *(space.shape or ()))
        if isinstance(space, spaces.Box):
            actions = np.stack([generator.uniform(-1, 1, shape[1:]) for generator in generators])
        else:
            size = (agents, sum(self._choices))
            draws = np.stack([generator.random(size) for generator in generators])
            masks = self._adapter.masks(seen, tuple(memory))
            draws = draws if masks is None else np.where(masks, draws, -1.0)
            parts = np.split(draws, np.cumsum(self._choices)[:-1], axis=2)
            actions = np.stack([part.argmax(axis=2) for part in parts], axis=-1).reshape(shape)
        action, after = self._adapter.act(seen, tuple(memory), actions)
        return action, (generators, *after)
