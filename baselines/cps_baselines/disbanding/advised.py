"""What learners of the defence play through if they start from the searched controller `string`."""

from __future__ import annotations

import numpy as np

from cps_baselines.disbanding.string_controller import Gains, shipped_gains
from cps_envs.core.config import bounds
from cps_envs.core.policy import RoleSpec
from cps_envs.disbanding.adapters import Follow
from cps_envs.disbanding.follower import SetPoints


class Strung(Follow):
    """`follow` around the numbers of `string`: zero is nearly what that does when it is always on.

    What `string` knows beyond the follower's form is left out: how gains change with tau, of which the middle is taken,
    and the acceleration of the disbanded vehicle.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        tau_s = float(np.mean(bounds(spec.config.tau_s)))
        self.neutral = np.array([follower_of(Gains(*row), tau_s) for row in shipped_gains("warned")[0]])


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
