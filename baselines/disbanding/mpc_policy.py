"""The paper's central mitigation as a policy: appendix A on what the defender observes, once per decision."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from baselines.disbanding.corrections import Corrections, Seen
from baselines.disbanding.mpc import (
    BEST_TUNED,
    PAPER_MATCHING,
    MpcSettings,
    MpcStack,
    design_mpc,
    mpc_of,
    pose,
    predictive_command,
    stack_mpc,
)
from baselines.disbanding.quadratic_program import Solver
from cps_envs.core.errors import ConfigurationError, MissingExtraError, near
from cps_envs.core.kernels import kernel
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.commands import clip
from cps_envs.disbanding.constants import Constants
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.episode import nominal_constants

SolverName = Literal["hildreth", "osqp"]
SOLVERS = ("hildreth", "osqp")


class Columns(NamedTuple):
    """What the controllers read of B episodes with M vehicles; the front vehicle has neither gap nor relative speed."""

    speed: FloatArray  # (B, M) m/s
    acceleration: FloatArray  # (B, M) m/s2
    gap: FloatArray  # (B, M - 1) m
    relative_speed: FloatArray  # (B, M - 1) m/s
    law_command: FloatArray  # (B, M) m/s2
    desired_gap_m: FloatArray  # (B,) m
    mitigable: BoolArray  # (B, M)


class MpcMitigation(Corrections):
    """Predict the errors of each vehicle over a horizon and brake optimally, swept front to rear in one decision.

    `solver` is "hildreth" (compiled dual iteration) or "osqp" (the OSQP library; the same commands, some 10 times
    slower). The observed lag must be at least half the MPC's period of 0.1 s.

    Raises:
        ConfigurationError: an unknown solver.
        ValueError: a lag for which the model is not usable.
    """

    def __init__(
        self, spec: RoleSpec, *, settings: MpcSettings = PAPER_MATCHING, solver: SolverName = "hildreth"
    ) -> None:
        super().__init__(spec)
        if solver not in SOLVERS:
            raise ConfigurationError(f"solver = {solver!r} is not known. {near(solver, SOLVERS)}")
        self.settings, self.solver = settings, solver
        self._constants = nominal_constants(spec.config)

    def corrections(self, seen: Seen) -> FloatArray:
        """See the class."""
        columns = Columns(**{name: seen[name] for name in Columns._fields[:-1]}, mitigable=self.mitigable(seen))
        out = np.zeros_like(columns.speed)
        taus = tuple(np.round(seen["tau_s"], 5).tolist())  # the rounding of float32 observations is not a new lag
        if self.solver == "hildreth":
            _sweep(columns, _stack(self.settings, taus), self._constants, self.settings.release, out)
        else:
            solvers = [_library_solver(self.settings, tau_s) for tau_s in taus]
            _sweep_with_library(columns, self.settings, taus, solvers, self._constants, out)
        return out


def paper_matching(spec: RoleSpec, solver: SolverName = "hildreth") -> MpcMitigation:
    """The MPC with weights tuned on the mpc column of Table 2.2."""
    return MpcMitigation(spec, settings=PAPER_MATCHING, solver=solver)


def best_tuned(spec: RoleSpec, solver: SolverName = "hildreth") -> MpcMitigation:
    """The MPC with a horizon of 2 s and no release: what this controller can do, far below the paper's column."""
    return MpcMitigation(spec, settings=BEST_TUNED, solver=solver)


@lru_cache(maxsize=8)
def _stack(settings: MpcSettings, taus_s: tuple[float, ...]) -> MpcStack:
    return stack_mpc(settings, np.array(taus_s))


@lru_cache(maxsize=256)
def _library_solver(settings: MpcSettings, tau_s: float) -> Solver:
    try:
        from baselines.disbanding.osqp_solver import OsqpSolver
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f'the solver "osqp" needs the package {error.name!r}. Install it with: pip install "cps-envs[baselines]"'
        ) from error
    return OsqpSolver(design_mpc(settings, tau_s).qp)


@kernel
def _sweep(columns: Columns, stack: MpcStack, c: Constants, release: bool, out: FloatArray) -> None:
    """Fill `out` (B, M) m/s2 with the corrections of the mitigable vehicles."""
    multipliers = np.empty(stack.qp.rows.shape[1])
    for b in range(out.shape[0]):
        mpc = mpc_of(stack, b)
        ahead = columns.law_command[b, 0]  # final command of the predecessor
        for q in range(1, out.shape[1]):
            if acts(columns, release, b, q):
                multipliers[:] = 0.0
                own = own_motion(columns, c, b, q)
                preceding = (columns.speed[b, q - 1], columns.acceleration[b, q - 1], ahead)
                command = predictive_command(own[0], own[1], own[2], own[3], preceding, c, mpc, multipliers)
                out[b, q] = command - columns.law_command[b, q]
            ahead = final_of(columns, c, out, b, q)


def _sweep_with_library(
    columns: Columns,
    settings: MpcSettings,
    taus_s: tuple[float, ...],
    solvers: list[Solver],
    c: Constants,
    out: FloatArray,
) -> None:
    """`_sweep` with the programs solved by a library."""
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    for b, (tau_s, solver) in enumerate(zip(taus_s, solvers, strict=True)):
        mpc = design_mpc(settings, tau_s)
        ahead = columns.law_command[b, 0]
        for q in range(1, out.shape[1]):
            if acts(columns, settings.release, b, q):
                preceding = (columns.speed[b, q - 1], columns.acceleration[b, q - 1], ahead)
                linear, limits = pose(*own_motion(columns, c, b, q), preceding, c, mpc)
                command = clip(solver.solve(linear, limits)[0], low, high)
                out[b, q] = command - columns.law_command[b, q]
            ahead = final_of(columns, c, out, b, q)


@kernel
def acts(columns: Columns, release: bool, b: int, q: int) -> bool:
    """Whether the controller acts on a vehicle: it is mitigable and, with `release`, closing in."""
    closing: bool = columns.relative_speed[b, q - 1] < 0.0
    return columns.mitigable[b, q] and (closing or not release)


@kernel
def own_motion(columns: Columns, c: Constants, b: int, q: int) -> tuple[float, float, float, float]:
    """Gap, desired gap (m), speed (m/s) and acceleration (m/s2) of a vehicle."""
    leads = q % c.vehicles_per_platoon == 0
    desired_gap = c.headway_s * columns.speed[b, q] if leads else columns.desired_gap_m[b]
    return columns.gap[b, q - 1], desired_gap, columns.speed[b, q], columns.acceleration[b, q]


@kernel
def final_of(columns: Columns, c: Constants, corrections: FloatArray, b: int, q: int) -> float:
    """The final command (m/s2) of a vehicle under its correction."""
    command = columns.law_command[b, q] + corrections[b, q]
    return final_command(command, columns.gap[b, q - 1], columns.speed[b, q], columns.speed[b, q - 1], c)
