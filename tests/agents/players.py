"""Policies for tests of training."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State


class Constant(AnalyticPolicy):
    """The same number in every entry of the action."""

    def __init__(self, spec: RoleSpec, value: float = 0.0) -> None:
        super().__init__(spec)
        self._value = value

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        return np.full((len(seen), *self.spec.neutral_action.shape), np.float32(self._value)), state
