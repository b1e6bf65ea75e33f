"""The paper's central mitigation as a policy: appendix A on what the defender observes, once per decision."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from cps_baselines.disbanding.corrections import Corrections, Layout, Sight, look, sight_for, sight_of
from cps_baselines.disbanding.mpc import (
    BEST_TUNED,
    PAPER_MATCHING,
    Mpc,
    MpcSettings,
    OwnMotion,
    Preceding,
    design_mpc,
    design_of,
    mpc_scratch,
    pose,
    predictive_command,
    stack_mpc,
)
from cps_baselines.disbanding.quadratic_program import Solver
from cps_envs.core.errors import ConfigurationError, MissingExtraError, near
from cps_envs.core.kernels import borrowed, clip, fill, inlined, kernel, lend, pack, unpack
from cps_envs.core.policy import RoleSpec
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.start import nominal_constants
from cps_envs.disbanding.state import Constants

SolverName = Literal["hildreth", "osqp"]
SOLVERS = ("hildreth", "osqp")


class MpcMitigation(Corrections):
    """Predict the errors of each vehicle over a horizon and brake optimally, swept front to rear in one decision.

    `solver` is "hildreth" (compiled dual iteration) or "osqp" (the OSQP library; the same commands, some 10 times
    slower). The observed lag must be at least half the MPC's period of 0.1 s.

    Raises:
        ConfigurationError: an unknown solver.
        ValueError: a lag for which the model is not usable.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        settings: MpcSettings = PAPER_MATCHING,
        solver: SolverName = "hildreth",
        **detection: float,
    ) -> None:
        super().__init__(spec, **detection)
        if solver not in SOLVERS:
            raise ConfigurationError(f"solver = {solver!r} is not known. {near(solver, SOLVERS)}")
        self.settings, self.solver = settings, solver
        self._constants = pack(nominal_constants(spec.config))

    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """See the class."""
        taus_s = np.round(seen["tau_s"], 5)  # the rounding of float32 observations is not a new lag
        if self.solver == "hildreth":
            known = (seen.observation, self.layout, reasons, seen["desired_gap_m"])
            release = self.settings.release
            _sweep(*known, *_stack(self.settings, taus_s.tobytes()), self._constants, release, corrections)
        else:
            self._correct_by_library(seen, reasons, taus_s.tolist(), corrections)

    def _correct_by_library(self, seen: Seen, reasons: BoolArray, taus_s: list[float], corrections: FloatArray) -> None:
        """The same in Python, with the programs solved by a library."""
        c = unpack(Constants, self._constants, 0)
        for b, tau_s in enumerate(taus_s):
            sight = sight_of(seen.observation[b], self.layout, reasons[b])
            solver, mpc = _library_solver(self.settings, tau_s), design_mpc(self.settings, tau_s)
            room = mpc_scratch(stack_mpc(self.settings, np.array([tau_s])))
            ahead = sight.law_command[0]
            for q in range(1, len(sight.speed)):
                if acts(sight, self.settings.release, q):
                    own, preceding = motions(sight, c, float(seen["desired_gap_m"][b]), ahead, q)
                    pose(own, preceding, c, mpc.model, room)
                    command = clip(
                        solver.solve(room.linear, room.limits)[0], c.min_acceleration_mps2, c.max_acceleration_mps2
                    )
                    corrections[b, q] = command - sight.law_command[q]
                ahead = final_of(sight, c, corrections[b], q)


def paper_matching(spec: RoleSpec, solver: SolverName = "hildreth", **detection: float) -> MpcMitigation:
    """Plays the paper's MPC, with weights tuned to match the mpc column of Table 2.2."""
    return MpcMitigation(spec, settings=PAPER_MATCHING, solver=solver, **detection)


def best_tuned(spec: RoleSpec, solver: SolverName = "hildreth", **detection: float) -> MpcMitigation:
    """Plays the MPC at its best, with a horizon of 2 s and no release. It does far better than in the paper."""
    return MpcMitigation(spec, settings=BEST_TUNED, solver=solver, **detection)


@lru_cache(maxsize=8)
def _stack(settings: MpcSettings, taus_s: bytes) -> tuple[Mpc, IntArray]:
    """The designs for the distinct ones of the lags, float64, and which of them each of the B episodes has."""
    distinct, which = np.unique(np.frombuffer(taus_s), return_inverse=True)
    return stack_mpc(settings, distinct), which.astype(np.int64)


@lru_cache(maxsize=256)
def _library_solver(settings: MpcSettings, tau_s: float) -> Solver:
    try:
        from cps_baselines.disbanding.osqp_solver import OsqpSolver
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f'the solver "osqp" needs the package {error.name!r}. Install it with: pip install "cps-envs[baselines]"'
        ) from error
    return OsqpSolver(design_mpc(settings, tau_s).qp)


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
