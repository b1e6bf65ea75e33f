"""The paper's decentralised mitigation as a policy: Algorithm 1 on what the defender observes, once per decision."""

from __future__ import annotations

import numpy as np

from baselines.disbanding.corrections import Corrections, Seen
from baselines.disbanding.heuristic import travelled_distance_command
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.commands import clip
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.episode import nominal_constants
from cps_envs.disbanding.lane import Constants, kernel


class HeuristicMitigation(Corrections):
    """Brake when you would travel farther than the vehicle ahead (Algorithm 1), swept front to rear in one decision.

    A vehicle returns to its own law as soon as the one ahead is not slower. The correction is held for the control
    period: 0.1 s costs 0.1 to 4 points against a decision at every integration step, `control_period_s=0.01`.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._constants = nominal_constants(spec.config)

    def corrections(self, seen: Seen) -> FloatArray:
        """See the class."""
        out = np.zeros_like(seen["speed"])
        columns = (seen["speed"], seen["gap"], seen["relative_speed"], seen["law_command"])
        _sweep(*columns, self.mitigable(seen), self._constants, out)
        return out


@kernel
def _sweep(
    speed: FloatArray,
    gap: FloatArray,
    relative_speed: FloatArray,
    law_command: FloatArray,
    mitigable: BoolArray,
    c: Constants,
    out: FloatArray,
) -> None:
    """Fill `out` (B, M) m/s2 with the corrections of the mitigable vehicles; `gap`, `relative_speed` are (B, M - 1)."""
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    for b in range(out.shape[0]):
        ahead = law_command[b, 0]  # final command of the predecessor
        for q in range(1, out.shape[1]):
            law, own, before, space = law_command[b, q], speed[b, q], speed[b, q - 1], gap[b, q - 1]
            if mitigable[b, q] and relative_speed[b, q - 1] < 0.0:
                out[b, q] = clip(travelled_distance_command(law, ahead, space, own, before, c), low, high) - law
            ahead = final_command(law + out[b, q], space, own, before, c)
