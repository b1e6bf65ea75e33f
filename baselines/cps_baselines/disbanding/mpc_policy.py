"""The paper's central mitigation as a policy: appendix A on what the defender observes, once per decision."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from cps_baselines.disbanding.corrections import Corrections, Layout, Sight, look, sight_for
from cps_baselines.disbanding.mpc import (
    BEST_TUNED,
    PAPER_MATCHING,
    Mpc,
    MpcSettings,
    OwnMotion,
    Preceding,
    design_of,
    mpc_scratch,
    predictive_command,
    stack_mpc,
)
from cps_envs.core.compute.kernels import borrowed, fill, inlined, kernel, lend, pack, unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.start import nominal_constants
from cps_envs.disbanding.state import Constants

SOLVER = "hildreth"


class MpcMitigation(Corrections):
    """Predict the errors of each vehicle over a horizon and brake optimally, swept front to rear in one decision.

    The observed lag must be at least half the MPC's period of 0.1 s.

    Raises:
        ValueError: a lag for which the model is not usable.
    """

    def __init__(self, spec: RoleSpec, *, settings: MpcSettings = PAPER_MATCHING, **detection: float) -> None:
        super().__init__(spec, **detection)
        self.settings = settings
        self._constants = pack(nominal_constants(spec.config))

    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """See the class."""
        taus_s = np.round(seen["tau_s"], 5)  # the rounding of float32 observations is not a new lag
        known = (seen.observation, self.layout, reasons, seen["desired_gap_m"])
        stack, which = _stack(self.settings, taus_s.tobytes())
        _sweep(*known, stack, which, self._constants, self.settings.release, corrections)


def paper_matching(spec: RoleSpec, solver: str = SOLVER, **detection: float) -> MpcMitigation:
    """Plays the paper's MPC, with weights tuned to match the mpc column of Table 2.2.

    There is one `solver`, Hildreth's dual iteration; panels of the challenge name it.

    Raises:
        ConfigurationError: another solver.
    """
    if solver != SOLVER:
        raise ConfigurationError(f"solver = {solver!r} is not known: the only one is {SOLVER!r}")
    return MpcMitigation(spec, settings=PAPER_MATCHING, **detection)


def best_tuned(spec: RoleSpec, **detection: float) -> MpcMitigation:
    """Plays the MPC at its best, with a horizon of 2 s and no release. It does far better than in the paper."""
    return MpcMitigation(spec, settings=BEST_TUNED, **detection)


@lru_cache(maxsize=8)
def _stack(settings: MpcSettings, taus_s: bytes) -> tuple[Mpc, IntArray]:
    """The designs for the distinct ones of the lags, float64, and which of them each of the B episodes has."""
    distinct, which = np.unique(np.frombuffer(taus_s), return_inverse=True)
    return stack_mpc(settings, distinct), which.astype(np.int64)


@kernel
def _sweep(
    observation: Observation,
    layout: Layout,
    reasons: BoolArray,
    desired_gap_m: FloatArray,
    stack: Mpc,
    which: IntArray,
    constants: Array,
    release: bool,
    corrections: FloatArray,
) -> None:
    """Fill `corrections` (B, M) m/s2 of the mitigable vehicles; episode b has design `which[b]` of the stack."""
    c, sight, room = unpack(Constants, constants, 0), sight_for(corrections.shape[1]), mpc_scratch(stack)
    multipliers = np.empty(stack.qp.rows.shape[1])
    for b in range(corrections.shape[0]):
        look(borrowed(observation)[b], lend(layout), borrowed(reasons)[b], sight)
        mpc, row = design_of(stack, which[b]), borrowed(corrections)[b]
        ahead = sight.law_command[0]  # final command of the predecessor
        for q in range(1, row.size):
            if acts(sight, release, q):
                fill(multipliers, 0.0)
                own, preceding = motions(sight, c, desired_gap_m[b], ahead, q)
                row[q] = predictive_command(own, preceding, c, mpc, multipliers, room) - sight.law_command[q]
            ahead = final_of(sight, c, row, q)


@inlined
def acts(sight: Sight, release: bool, q: int) -> bool:
    """Whether the controller acts on a vehicle: it is mitigable and, with `release`, closing in."""
    return bool(sight.mitigable[q]) and (not release or bool(sight.relative_speed[q] < 0.0))


@inlined
def motions(sight: Sight, c: Constants, desired_gap_m: float, ahead: float, q: int) -> tuple[OwnMotion, Preceding]:
    """Vehicle `q`, and its predecessor with the final command `ahead` (m/s2)."""
    leads = q % c.vehicles_per_platoon == 0
    desired_gap = c.headway_s * sight.speed[q] if leads else desired_gap_m
    own = OwnMotion(sight.gap[q], desired_gap, sight.speed[q], sight.acceleration[q])
    return own, Preceding(sight.speed[q - 1], sight.acceleration[q - 1], ahead)


@inlined
def final_of(sight: Sight, c: Constants, corrections: FloatArray, q: int) -> float:
    """The final command (m/s2) of a vehicle under its correction."""
    command = sight.law_command[q] + corrections[q]
    return final_command(command, sight.gap[q], sight.speed[q], sight.speed[q - 1], c)
