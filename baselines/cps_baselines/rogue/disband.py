"""The modified sliding mode (5.12) to (5.14): follow at growing separations, then hand over to human drivers."""

from __future__ import annotations

import numpy as np

from cps_baselines.rogue.controllers import require_modes
from cps_envs.core.compute.kernels import Record, copy, inlined, kernel
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, Observation, State
from cps_envs.rogue.actions import MODIFIED, PLAIN
from cps_envs.rogue.controllers import CONTROLLERS, DRIVEN, HUMAN
from cps_envs.rogue.reading import read

ROUNDING_M = 1e-3  # of observed growths


class Disband(AnalyticPolicy):
    """Detection with growing separations; all become human once one that follows wants `threshold_m` more than sigma.

    A growth acts from the next integration step on. The disbanding is to act from there too, so it is decided one
    decision ahead: when the error of a vehicle allows its last growth.

    Raises:
        ConfigurationError: the environment takes accelerations, not controllers; or the separations cannot grow so far.
    """

    def __init__(self, spec: RoleSpec, threshold_m: float = 7.0) -> None:
        super().__init__(spec)
        require_modes(spec, self)
        if not 0 < threshold_m <= spec.config.max_growth_m:
            raise ConfigurationError(
                f"threshold_m = {threshold_m} has to be above 0 and at most max_growth_m = {spec.config.max_growth_m}"
            )
        count, self.threshold_m = spec.config.num_orders, threshold_m
        self.together = np.tile([CONTROLLERS.index("detecting"), MODIFIED], count)
        self.apart = np.tile([CONTROLLERS.index("human"), PLAIN], count)

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The controllers (B, 2 (n - 1)) of the intact vehicles."""
        config, size = self.spec.config, self.together.size
        actions = np.empty((len(seen), size), np.int64)
        limits = (config.separation_m, config.inner_share, config.growth_step_m, self.threshold_m)
        _disband(seen.observation, seen.fields.offsets, seen.fields.scale, limits, self.together, self.apart, actions)
        return actions, state


@kernel
def _disband(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    limits: tuple[float, float, float, float],
    together: IntArray,
    apart: IntArray,
    actions: IntArray,
) -> None:
    """Fill the actions (B, 2 (n - 1)): those of disbanding once a vehicle is ready for it, or drives by hand."""
    separation_m, inner_share, step_m, threshold_m = limits
    at = offsets[0]
    for b in range(actions.shape[0]):
        leaving = False
        for k in range(actions.shape[1] // 2):
            growth = read(observation, scale, b, at.growth + k) + ROUNDING_M
            if abs(read(observation, scale, b, at.alarm + k)) > 0.5:
                error = followed_error(observation, at, scale, b, k)
                grows = abs(error) < inner_share * separation_m
                leaving |= growth >= threshold_m or (grows and growth + step_m >= threshold_m)
            leaving |= read(observation, scale, b, at.law + k * len(DRIVEN) + HUMAN) > 0.5
        copy(apart if leaving else together, actions[b])


@inlined
def followed_error(observation: Observation, at: Record, scale: FloatArray, b: int, k: int) -> float:
    """The error e, m, of intact vehicle `k` on the side of its alarm, where its separation has grown."""
    i = k
    for seat in range(at.attacker_index, at.present):
        i += i >= round(read(observation, scale, b, seat)) - 1
    growth = read(observation, scale, b, at.growth + k)
    if read(observation, scale, b, at.alarm + k) > 0.5:
        leads = i == at.gap_rate - at.gap_error
        ahead = at.reference_error if leads else at.gap_error + i
        return read(observation, scale, b, ahead) - growth
    behind = -read(observation, scale, b, at.gap_error + i - 1) if i > 0 else 0.0
    return behind + growth


def disband_2(spec: RoleSpec) -> Disband:
    """Plays the modified sliding mode, which disbands the platoon at +2 m (Figs. 5.5 and 5.9)."""
    return Disband(spec, 2.0)


def disband_4(spec: RoleSpec) -> Disband:
    """Plays the modified sliding mode, which disbands the platoon at +4 m (Fig. 5.10)."""
    return Disband(spec, 4.0)


def disband_7(spec: RoleSpec) -> Disband:
    """Plays the modified sliding mode, which disbands the platoon at +7 m (Fig. 5.11)."""
    return Disband(spec, 7.0)
