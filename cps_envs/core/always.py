"""A policy that takes one action, whatever it sees."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_envs.core.actions import ActionReader
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State, repeat
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array


class Always(AnalyticPolicy):
    """Takes the same action at every decision: `always?action=[0,0,1,1]`. A learner should beat the best of them.

    A single number stands for all entries of the action.

    Raises:
        ValueError: an action that is not in the action space.
    """

    def __init__(self, spec: RoleSpec, *, action: Any) -> None:
        super().__init__(spec)
        shape = spec.neutral_action.shape
        given = np.asarray(action)
        filled = np.full(shape, given) if given.ndim == 0 else given
        self.action: Array = ActionReader(spec.action_space).batch(filled[np.newaxis], 1)[0]

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """That action for every environment."""
        return repeat(self.action, len(seen)), state
