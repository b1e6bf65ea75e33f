"""The paper's decentralised mitigation as a policy: Algorithm 1 on what the defender observes, once per decision."""

from __future__ import annotations

import numpy as np

from baselines.disbanding.corrections import Corrections, Seen
from baselines.disbanding.heuristic import FORESIGHT, Foresight, travelled_distance_command
from cps_envs.core.config import is_multiple
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.kernels import kernel
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.commands import clip
from cps_envs.disbanding.constants import Constants
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.episode import nominal_constants


class HeuristicMitigation(Corrections):
    """Brake when you would travel farther than the vehicle ahead (Algorithm 1), swept front to rear in one decision.

    A vehicle returns to its own law as soon as the one ahead is not slower. The correction is held for the control
    period: 0.1 s costs 0.1 to 4 points against a decision at every integration step, `control_period_s=0.01`.

    `avoidance=False` tells it that collision avoidance does not act on the vehicles that it corrects.

    Raises:
        ConfigurationError: samples that do not divide the horizon, or a decrement that leads nowhere.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        horizon_s: float = FORESIGHT.num_samples * FORESIGHT.sample_s,
        sample_s: float = FORESIGHT.sample_s,
        decrement_mps2: float = FORESIGHT.decrement_mps2,
        clearance_m: float = FORESIGHT.clearance_m,
        avoidance: bool = True,
    ) -> None:
        super().__init__(spec)
        if not (sample_s > 0 and is_multiple(horizon_s, sample_s)):
            raise ConfigurationError(f"horizon_s = {horizon_s} has to be a multiple of sample_s = {sample_s}.")
        if not decrement_mps2 > 0:
            raise ConfigurationError(f"decrement_mps2 = {decrement_mps2} has to be above 0.")
        self._foresight = Foresight(
            round(horizon_s / sample_s), float(sample_s), float(decrement_mps2), float(clearance_m)
        )
        self._constants = nominal_constants(spec.config)
        self._avoidance = avoidance

    def corrections(self, seen: Seen) -> FloatArray:
        """See the class."""
        out = np.zeros_like(seen["speed"])
        columns = (seen["speed"], seen["gap"], seen["relative_speed"], seen["law_command"])
        _sweep(*columns, self.mitigable(seen), self._constants, self._foresight, self._avoidance, out)
        return out


@kernel
def _sweep(
    speed: FloatArray,
    gap: FloatArray,
    relative_speed: FloatArray,
    law_command: FloatArray,
    mitigable: BoolArray,
    c: Constants,
    foresight: Foresight,
    avoidance: bool,
    out: FloatArray,
) -> None:
    """Fill `out` (B, M) m/s2 with the corrections of the mitigable vehicles; `gap`, `relative_speed` are (B, M - 1)."""
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    for b in range(out.shape[0]):
        ahead = law_command[b, 0]  # final command of the predecessor
        for q in range(1, out.shape[1]):
            law, own, before, space = law_command[b, q], speed[b, q], speed[b, q - 1], gap[b, q - 1]
            if mitigable[b, q] and relative_speed[b, q - 1] < 0.0:
                command = travelled_distance_command(law, ahead, space, own, before, c, foresight)
                out[b, q] = clip(command, low, high) - law
            ahead = law + out[b, q]
            if avoidance or not mitigable[b, q]:
                ahead = final_command(ahead, space, own, before, c)
