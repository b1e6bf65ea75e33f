"""Extension beyond the paper: an attacker that makes drivers take over by nothing but motion."""

from __future__ import annotations

import numpy as np

from cps_baselines.disbanding.timed import count_platoons
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State

HALF = 0.5  # of an entry that is 0 or 1


@plays_in("drivers")
class Shake(AnalyticPolicy):
    """Jolts the foremost intact platoon every `every_s`, until its drivers take over, and then the next one.

    The wave behind a disbanded platoon alarms the drivers behind for nothing; where a defender holds it back, the
    attacker goes on after `rest_s`.

    Raises:
        ConfigurationError: the attacker of this configuration sends messages and jolts nobody; or times below 1 s.
    """

    def __init__(self, spec: RoleSpec, *, every_s: float = 1.0, rest_s: float = 30.0) -> None:
        super().__init__(spec)
        if spec.config.attack != "jolt":
            raise ConfigurationError('Shake jolts vehicles; it needs attack="jolt", as in preset drivers')
        if every_s < 1 or rest_s < 1:
            raise ConfigurationError(f"every_s = {every_s} and rest_s = {rest_s} have to be at least 1")
        self.every_s, self.rest_s = round(every_s), round(rest_s)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Seconds until the next jolt, (B,)."""
        return (np.zeros(len(generators), np.int64),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The platoon to jolt, or 0, for each episode (B,)."""
        (wait,) = state
        disbanded = seen["disbanded"] > HALF
        numbers = np.arange(1, disbanded.shape[1] + 1)
        present = numbers <= count_platoons(seen, disbanded)[:, np.newaxis]
        target = np.where(present & ~disbanded, numbers, 0).max(axis=1)
        since_s = np.where(disbanded, seen["since_disbanding_s"], np.inf).min(axis=1)
        opens = seen["opens_in_s"] < HALF if "opens_in_s" in seen else np.ones(len(seen), np.bool_)
        ready = opens & (wait <= 0) & (since_s >= self.rest_s) & (seen["budget_left"] > HALF) & (seen["time_s"] > HALF)
        action = np.where(ready, target, 0)
        return action, (np.where(action > 0, self.every_s - 1, np.maximum(wait - 1, 0)),)
