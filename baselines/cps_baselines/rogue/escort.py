"""Extension beyond the paper: a defender that is told who is seized, and gives way to it by accelerations."""

from __future__ import annotations

import numpy as np

from cps_baselines.family import as_records
from cps_baselines.rogue.reading import require_one
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, Knowledge, State
from cps_envs.rogue.giving_way import NOBODY, GivingWay, Ways


class Escort(AnalyticPolicy):
    """From the onset on, vehicles ahead of the attacker give way to it, and those behind it follow.

    Nobody ahead lets the vehicle behind it come up faster than it can avoid. The neighbor of an attacker that is near
    mirrors its acceleration, so that no gap opens for a run-up. A slow attacker is left alone. It knows the seat and
    the onset, orders one of the accelerations of `LEVELS`, and filters what it measures of the gaps. `numbers` is
    (19,), or (B, 19) with one set per episode: `Ways`.

    Raises:
        ConfigurationError: the environment offers no accelerations beside the controllers, or marks the seized vehicle,
            or several attack together.
    """

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec, numbers: FloatArray) -> None:
        super().__init__(spec)
        require_one(spec, self)
        self.giving_way = GivingWay(spec, as_records(Ways, numbers))

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The seats (B,), the onsets (B,) in s, and the gaps and rates (B, n - 1) as they are filtered."""
        truths = [known["truth"] for known in knowledge]
        seats, onsets_s = (np.array([truth[name] for truth in truths]) for name in ("seat", "onset_s"))
        return seats, onsets_s, self.giving_way.unfiltered(len(truths)), self.giving_way.unfiltered(len(truths))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The orders (B, 2 n) of all vehicles."""
        seats, onsets_s, gaps, rates = state
        since_s = self.spec.config.duration_s - seen["time_left_s"]
        attacked = since_s > onsets_s - self.spec.decision_interval_s / 2
        orders, gaps, rates = self.giving_way.orders(seen, np.where(attacked, seats, NOBODY), gaps, rates)
        return orders, (seats, onsets_s, gaps, rates)
