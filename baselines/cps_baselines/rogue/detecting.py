"""The scheme of Fig. 5.1b with the "traditional bidirectional law" of section 5.2.3 under normal circumstances."""

from __future__ import annotations

import numpy as np

from cps_baselines.rogue.controllers import require_modes
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State
from cps_envs.rogue.controllers import FRONT, LINEAR, REAR


class LinearDetection(AnalyticPolicy):
    """Drives each vehicle by the linear law (5.15) until its own alarm, then follows the side of the alarm.

    Following is the sliding mode (5.9) on one side. The switch comes with the next decision, up to 0.1 s after the
    alarm. The detectors expect neighbours that drive by the sliding mode, as everywhere in the problem.

    Raises:
        ConfigurationError: the environment takes accelerations, not controllers.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        require_modes(spec, self)

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The controllers (B, 2 k) of the k vehicles that get orders; following is plain."""
        alarm = np.rint(seen["alarm"]).astype(np.int64)
        laws = np.where(alarm > 0, FRONT, np.where(alarm < 0, REAR, LINEAR))
        orders: Array = np.stack([laws, np.zeros_like(laws)], axis=2)
        return orders.reshape(len(laws), -1), state
