"""What learners of the defence play through if they start from the searched controller `string`."""

from __future__ import annotations

import numpy as np

from cps_baselines.disbanding.string_controller import Gains, shipped_gains
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.adapters import Follow
from cps_envs.disbanding.follower import SetPoints


class Strung(Follow):
    """`follow` around the numbers of `string`: zero is nearly what that does when it is always on.

    What does not fit the follower's form is left out: the acceleration of the disbanded vehicle, and how much faster
    than desired vehicles may drive.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        rows = [Gains(*row) for row in shipped_gains("warned")[0]]
        self._usual = np.array([follower_of(row, 0.0) for row in rows])  # (2, 11)
        self._lag = np.array([follower_of(row, 1.0) for row in rows]) - self._usual  # per second of tau

    def neutral_points(self, seen: Seen) -> FloatArray:
        """The set-points of action 0, (B, 1, 2, 11), which depend on the actuators' lag."""
        points: FloatArray = self._usual + seen["tau_s"].reshape(-1, 1, 1, 1) * self._lag
        return points


def follower_of(g: Gains, tau_s: float) -> SetPoints:
    """The set-points that come closest to gains: u = a* + lead (a* - a), so that the own gain is minus the lead."""
    lead = -g.own
    part = 1.0 / (1.0 + lead)  # of a gain of u that a* has
    return SetPoints(
        gap=part * g.gap,
        wanted_m=g.wanted_m,
        headway_s=g.headway_s,
        closing=part * (g.closing + g.closing_lag * tau_s),
        predecessor=part * (g.predecessor + g.predecessor_lag * tau_s),
        lead=lead,
        ahead_closing=part * g.ahead_closing,
        ahead_command=part * g.ahead_command,
        cap=g.cap,
        law=-g.law,
        silence=0.0,
    )
