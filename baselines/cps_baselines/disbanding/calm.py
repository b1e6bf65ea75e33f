"""Extension beyond the paper: a defender that keeps the motion below what makes drivers take over."""

from __future__ import annotations

import numpy as np

from cps_baselines.disbanding.string_controller import StringController
from cps_envs.core.declare.config import bounds
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import BoolArray, FloatArray


@plays_in("drivers")
class Calm(StringController):
    """Drives by the numbers of `string`, but brakes and jerks less than what alarms the most nervous driver.

    Braking stays below `share` of the lowest `alarming_braking_mps2` that a driver can have, and jerks below `share` of
    the lowest `alarming_jerk_mps3`. A gap below the largest `alarming_gap_m` and `spare_m` more is an emergency, in
    which `string` brakes as it likes. All vehicles act from the start on, so that they have room before an attack.

    Raises:
        ConfigurationError: no driver watches, a share outside (0, 1], or a spare gap below 0.
    """

    def __init__(self, spec: RoleSpec, *, share: float = 0.95, spare_m: float = 0.5) -> None:
        super().__init__(spec, detection_mps=0.0)
        config = spec.config
        require_watchful(spec, self)
        if not (0 < share <= 1 and spare_m >= 0):
            raise ConfigurationError(
                f"share = {share} has to be above 0 and at most 1, and spare_m = {spare_m} at least 0"
            )
        limits = (config.alarming_braking_mps2, config.alarming_jerk_mps3)
        self._braking_mps2, self._jerk_mps3 = (share * bounds(limit)[0] or np.inf for limit in limits)
        self._least_m = bounds(config.alarming_gap_m)[1] + spare_m

    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """See the class."""
        super().correct(seen, reasons, corrections)
        law, done, period_s = seen["law_command"], seen["acceleration"], self.spec.config.control_period_s
        gap = np.pad(seen["gap"], ((0, 0), (1, 0)), constant_values=np.inf)
        lag = -np.expm1(-period_s / seen["tau_s"][:, np.newaxis])  # of a change, what comes within a period
        reach = self._jerk_mps3 * period_s / lag
        soft = done + np.clip(law + corrections - done, -reach, reach)
        softened = np.maximum(soft, -self._braking_mps2) - law
        corrections[:] = np.where(reasons & (gap >= self._least_m), softened, corrections)


def require_watchful(spec: RoleSpec, policy: AnalyticPolicy) -> None:
    """Refuse roads on which no driver takes over because of what they see.

    Raises:
        ConfigurationError: this is one.
    """
    if not spec.config.watchful:
        raise ConfigurationError(
            f"{type(policy).__name__} is about drivers who watch, and here none does: take preset drivers, or give "
            "alarming_braking_mps2, alarming_jerk_mps3 or alarming_gap_m"
        )
