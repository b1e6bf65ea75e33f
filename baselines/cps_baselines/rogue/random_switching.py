"""An attacker that knows nothing: full driving and full braking effort for random times."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, Knowledge, State


class RandomSwitching(AnalyticPolicy):
    """Drives fully for `driving_s` and brakes fully for `braking_s` on average: times are geometric.

    Raises:
        ConfigurationError: a mean time below the attacker's decision interval.
    """

    def __init__(self, spec: RoleSpec, driving_s: float = 4.0, braking_s: float = 1.0) -> None:
        super().__init__(spec)
        if min(driving_s, braking_s) < spec.decision_interval_s:
            raise ConfigurationError(
                f"driving_s = {driving_s} and braking_s = {braking_s} have to be at least attack_hold_s = "
                f"{spec.decision_interval_s:g}"
            )
        self.leave_driving = spec.decision_interval_s / driving_s
        self.leave_braking = spec.decision_interval_s / braking_s

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The signs (B, decisions) of the whole episode."""
        return (np.stack([self._draw(generator) for generator in generators]),)

    def _draw(self, generator: np.random.Generator) -> FloatArray:
        draws = generator.random(round(self.spec.config.duration_s / self.spec.decision_interval_s))
        signs, sign = np.empty(len(draws)), 1.0
        for k, draw in enumerate(draws.tolist()):
            if draw < (self.leave_driving if sign > 0 else self.leave_braking):
                sign = -sign
            signs[k] = sign
        return signs

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The actions (B, seats), each -1 or 1, alike for all seats."""
        (signs,) = state
        left = np.round(seen["time_left_s"] / self.spec.decision_interval_s)
        decision = signs.shape[1] - left.astype(np.int64)
        now = np.clip(decision, 0, signs.shape[1] - 1)
        drawn = signs[np.arange(len(signs)), now][:, np.newaxis]
        return np.repeat(drawn, self.spec.neutral_action.size, axis=1), state
