"""What learners of the attack play through if they start from the controller `task_tracker`: larger or smaller lies."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_baselines.fdi.families import task_tracker
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, State
from cps_envs.fdi.adapters.lying import Lying

MOST = 1.5  # deviations by which an action of 1 raises the margins; chosen


class Margins(Lying):
    """Box (2,): how much more than `task_tracker`'s are the margins of ranges and of range-rates, in parts of `MOST`.

    A margin is by how many standard deviations a lie exceeds what the filter expects. Zero plays `task_tracker`.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._tracker = task_tracker(spec)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.neutral_action = np.zeros(2, np.float32)

    def begin(self, num_envs: int) -> State:
        """What the controller remembers."""
        return self._tracker.begin([np.random.default_rng()] * num_envs, [])

    def lies(self, seen: Seen, state: State) -> FloatArray:
        """The mean injections of the last step, into attacked ranges and into attacked range-rates."""
        return self.injected(seen)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The role's actions (B, S)."""
        levels, held = self._tracker.track(seen, state, MOST * actions[:, 0].astype(np.float64))
        return levels, held
