"""The modified sliding mode (5.12) to (5.14): follow at growing separations, then hand over to human drivers."""

from __future__ import annotations

import numpy as np

from baselines.rogue.laws import require_laws
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray
from cps_envs.rogue.actions import MODIFIED, PLAIN
from cps_envs.rogue.controllers import CONTROLLERS, DRIVEN

ROUNDING_M = 1e-3  # of observed growths


class Disband(AnalyticPolicy):
    """Detection with growing separations; all become human once one that follows wants `threshold_m` more than sigma.

    A growth acts from the next integration step on. The disbanding is to act from there too, so it is decided one
    decision ahead: when the error of a vehicle allows its last growth.

    Raises:
        ConfigurationError: the environment takes accelerations, not laws; or the separations cannot grow so far.
    """

    def __init__(self, spec: RoleSpec, threshold_m: float = 7.0) -> None:
        super().__init__(spec)
        require_laws(spec, self)
        if not 0 < threshold_m <= spec.config.max_growth_m:
            raise ConfigurationError(
                f"threshold_m = {threshold_m} has to be above 0 and at most max_growth_m = {spec.config.max_growth_m}"
            )
        count, self.threshold_m = spec.config.num_intact, threshold_m
        self.together = np.tile([CONTROLLERS.index("detecting"), MODIFIED], count)
        self.apart = np.tile([CONTROLLERS.index("human"), PLAIN], count)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The laws (B, 2 (n - 1)) of the intact vehicles."""
        config = self.spec.config
        following = np.abs(seen["alarm"]) > 0.5
        grows = np.abs(followed_errors(seen, config.num_vehicles)) < config.inner_share * config.separation_m
        growth = seen["growth"] + ROUNDING_M
        complete = (growth >= self.threshold_m) | (grows & (growth + config.growth_step_m >= self.threshold_m))
        human = seen["law"][:, :, DRIVEN.index("human")] > 0.5
        apart = np.any((following & complete) | human, axis=1)
        return np.where(apart[:, np.newaxis], self.apart, self.together), state


def followed_errors(seen: Seen, num_vehicles: int) -> FloatArray:
    """The error e (B, n - 1), m, of each intact vehicle on the side of its alarm, where its separation has grown."""
    seized = np.round(seen["attacker_index"]).astype(np.int64)[:, np.newaxis] - 1
    place = np.arange(num_vehicles - 1)
    vehicle = place + (place >= seized)
    gaps = seen["gap_error"]
    nobody = np.zeros((len(gaps), 1))
    front = np.hstack([gaps, seen["reference_error"][:, np.newaxis]])
    rear = np.hstack([nobody, -gaps])
    ahead = np.take_along_axis(front, vehicle, axis=1) - seen["growth"]
    behind = np.take_along_axis(rear, vehicle, axis=1) + seen["growth"]
    return np.where(seen["alarm"] > 0.5, ahead, behind)


def disband_2(spec: RoleSpec) -> Disband:
    """The modified sliding mode that disbands the platoon at +2 m, Figs. 5.5 and 5.9."""
    return Disband(spec, 2.0)


def disband_4(spec: RoleSpec) -> Disband:
    """The modified sliding mode that disbands the platoon at +4 m, Fig. 5.10."""
    return Disband(spec, 4.0)


def disband_7(spec: RoleSpec) -> Disband:
    """The modified sliding mode that disbands the platoon at +7 m, Fig. 5.11."""
    return Disband(spec, 7.0)
