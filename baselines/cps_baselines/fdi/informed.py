"""A defender that is told which sensors are attacked and when: what is left to infer is what it is better by."""

from __future__ import annotations

import numpy as np

from cps_baselines.fdi.platoon_filter import platoon_filter
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State


class Informed(AnalyticPolicy):
    """Knows which sensors are attacked, and replaces exactly those readings from the attack's first step on.

    Raises:
        ConfigurationError: the configuration has no filter.
    """

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        platoon_filter(spec.config)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The attacked readings (B, R) and the onsets (B,) of the episodes."""
        truths = [known["truth"] for known in knowledge]
        return np.array([truth["attacked"] for truth in truths]), np.array([truth["onset"] for truth in truths])

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, R + n)."""
        attacked, onset = state
        step = self.spec.config.horizon - np.rint(seen["steps_left"])
        actions = repeat(self.spec.neutral_action, len(seen))
        actions[:, : attacked.shape[1]][attacked & (step >= onset)[:, np.newaxis]] = 0
        return actions, state
