"""A policy that takes one action, whatever it sees."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State


class Always(AnalyticPolicy):
    """Takes the same action at every decision: `always?action=[0,0,1,1]`. A learner should beat the best of them.

    A single number stands for all entries of the action. With an adapter all its agents take the action:
    `always?adapter=motion&action=7`. Of a Box what lies outside its bounds counts as the nearest action inside.

    Raises:
        ValueError: an action of another shape, that is not finite, or that is discrete and not in the action space.
        UnknownNameError: the role has no such adapter.
    """

    def __init__(self, spec: RoleSpec, *, action: Any, adapter: str = NATIVE) -> None:
        super().__init__(spec)
        self._adapter = adapter_of(spec, adapter)
        self.decentralised = self._adapter.local
        shape = self._adapter.neutral_action.shape
        given = np.asarray(action)
        filled = np.full(shape, given) if given.ndim == 0 else given
        self.action: Array = ActionReader(self._adapter.action_space).batch(filled[np.newaxis], 1)[0]

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What the adapter remembers."""
        return self._adapter.begin(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """That action for every agent of every environment."""
        taken = np.full((len(seen), len(self._adapter.agents), *self.action.shape), self.action)
        return self._adapter.act(seen, state, taken)
