"""The model-predictive mitigation of appendix A with corrected signs, for one vehicle that follows another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.disbanding.quadratic_program import (
    SWEEPS,
    TOLERANCE,
    QuadraticProgram,
    climb_dual,
    constrain,
    quadratic_program,
    slacks,
)
from cps_envs.core.kernels import kernel
from cps_envs.disbanding.commands import clip
from cps_envs.disbanding.constants import Constants

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class MpcSettings:
    """What appendix A leaves open; errors are those of gap (m), speed (m/s) and acceleration (m/s2)."""

    name: str
    horizon: int  # H, periods predicted
    period_s: float  # T, sampling time; the command is held for it
    command_weight: float  # R
    error_weights: tuple[float, float, float]  # diagonal of Q
    terminal_weights: tuple[float, float, float]  # diagonal of Y
    release: bool  # the vehicle returns to its own law while its gap does not shrink


# One set for six cells, tuned on the mpc column of Table 2.2: "MPC (tuned to the paper)".
PAPER_MATCHING = MpcSettings("paper-matching", 5, 0.1, 0.1, (1.0, 5.0, 0.0), (1.0, 5.0, 0.0), release=True)
# The lowest E_v found for this controller; shows that the paper's "optimal" column is not near-optimal in E_v.
BEST_TUNED = MpcSettings("best-tuned", 20, 0.1, 1.0, (1.0, 1.0, 0.0), (1.0, 1.0, 0.0), release=False)


class Mpc(NamedTuple):
    """Everything constant for one lag and one set of weights. H = horizon, m = 5 H - 4 rows.

    Predicted errors, stacked over the horizon: error_response e + command_response u_p + (effect of U).
    Rows: gap >= 0 from period 3, speed within its limits from period 2 (before, U has no effect), u within its limits.
    """

    period_s: float
    tau_s: float
    error_response: Vector  # (3H, 3) Abar
    command_response: Vector  # (3H,) Bbar2 times ones
    linear_error: Vector  # (H, 3) f per error
    linear_command: Vector  # (H,) f per command ahead
    qp: QuadraticProgram  # M2 and the rows


class MpcStack(NamedTuple):
    """One `Mpc` per episode: the same fields with a leading episode axis."""

    period_s: Vector  # (B,)
    tau_s: Vector  # (B,)
    error_response: Vector  # (B, 3H, 3)
    command_response: Vector  # (B, 3H)
    linear_error: Vector  # (B, H, 3)
    linear_command: Vector  # (B, H)
    qp: QuadraticProgram  # fields with an episode axis


@lru_cache(maxsize=256)
def design_mpc(settings: MpcSettings, tau_s: float) -> Mpc:
    """The constant matrices for the actuation lag `tau_s`; ValueError when the model (A.2) is not usable for it."""
    period = settings.period_s
    if tau_s < period / 2.0:
        raise ValueError(
            f"tau_s = {tau_s:g} s is below half the MPC period of {period:g} s, where the Euler model (A.2) oscillates "
            f"without decay: choose period_s <= {2.0 * tau_s:g} s or a larger tau_s"
        )
    horizon, ratio = settings.horizon, period / tau_s
    step = np.array([[1.0, period, 0.0], [0.0, 1.0, period], [0.0, 0.0, 1.0 - ratio]])
    own = np.array([0.0, 0.0, -ratio])
    powers = [np.linalg.matrix_power(step, m) for m in range(horizon + 1)]
    own_response = np.zeros((3 * horizon, horizon))  # Bbar1; Bbar2 is its negative
    for r in range(horizon):
        for c in range(r + 1):
            own_response[3 * r : 3 * r + 3, c] = powers[r - c] @ own
    error_response = np.vstack(powers[1:])
    command_response = -own_response.sum(axis=1)
    weights = np.array([*settings.error_weights] * (horizon - 1) + [*settings.terminal_weights])
    weighted = own_response.T * weights
    hessian = settings.command_weight * np.eye(horizon) + weighted @ own_response
    gap_rows, speed_rows, unit = own_response[6::3], own_response[4::3], np.eye(horizon)
    rows = np.vstack([-gap_rows, -speed_rows, speed_rows, unit, -unit])
    linear_error, linear_command = weighted @ error_response, weighted @ command_response
    qp = quadratic_program(hessian, rows)
    return Mpc(period, tau_s, error_response, command_response, linear_error, linear_command, qp)


def stack_mpc(settings: MpcSettings, taus_s: Vector) -> MpcStack:
    """The designs for the lags (B,) of all episodes; ValueError as `design_mpc`."""
    designs = [design_mpc(settings, float(tau_s)) for tau_s in taus_s]
    return MpcStack(
        np.array([design.period_s for design in designs]),
        np.array([design.tau_s for design in designs]),
        np.stack([design.error_response for design in designs]),
        np.stack([design.command_response for design in designs]),
        np.stack([design.linear_error for design in designs]),
        np.stack([design.linear_command for design in designs]),
        QuadraticProgram(*map(np.stack, zip(*(design.qp for design in designs), strict=True))),
    )


@kernel
def mpc_of(stack: MpcStack, b: int) -> Mpc:
    """The design of episode `b` of a stack."""
    qp = stack.qp
    return Mpc(
        stack.period_s[b],
        stack.tau_s[b],
        stack.error_response[b],
        stack.command_response[b],
        stack.linear_error[b],
        stack.linear_command[b],
        QuadraticProgram(qp.hessian[b], qp.rows[b], qp.inverse[b], qp.row_response[b], qp.dual_hessian[b]),
    )


@kernel
def assemble(
    mpc: Mpc,
    error: Vector,
    desired_gap: float,
    ahead: tuple[float, float, float],
    c: Constants,
    linear: Vector,
    limits: Vector,
) -> None:
    """Fill the linear term f (H,) and the limits w (m,) of the program of one vehicle at one time.

    `error` (3,) = (gap - desired gap in m, speed ahead - own in m/s, acceleration ahead - own in m/s2); `ahead` =
    (speed in m/s, acceleration in m/s2, command in m/s2) of the predecessor, whose speed is predicted by Euler.
    """
    horizon = linear.shape[0]
    speed, acceleration, command = ahead
    for m in range(horizon):
        linear[m] = mpc.linear_command[m] * command
        for k in range(3):
            linear[m] += mpc.linear_error[m, k] * error[k]
        limits[3 * horizon - 4 + m] = c.max_acceleration_mps2
        limits[4 * horizon - 4 + m] = -c.min_acceleration_mps2
        speed += mpc.period_s * acceleration
        acceleration += mpc.period_s * (command - acceleration) / mpc.tau_s
        if m >= 2:
            limits[m - 2] = desired_gap + free_error(mpc, 3 * m, error, command)
        if m >= 1:
            closing = free_error(mpc, 3 * m + 1, error, command)
            limits[horizon - 3 + m] = c.max_speed_mps - speed + closing
            limits[2 * horizon - 4 + m] = speed - c.min_speed_mps - closing


@kernel
def free_error(mpc: Mpc, row: int, error: Vector, command: float) -> float:
    """Row `row` of the stacked errors predicted for U = 0."""
    value: float = mpc.command_response[row] * command
    for k in range(3):
        value += mpc.error_response[row, k] * error[k]
    return value


@kernel
def pose(
    gap: float,
    desired_gap: float,
    speed: float,
    acceleration: float,
    ahead: tuple[float, float, float],
    c: Constants,
    mpc: Mpc,
) -> tuple[Vector, Vector]:
    """The linear term f (H,) and the limits w (m,) of one vehicle's program; arguments as `predictive_command`."""
    speed_ahead, acceleration_ahead, command_ahead = ahead
    command_ahead = clip(command_ahead, c.min_acceleration_mps2, c.max_acceleration_mps2)
    if speed_ahead <= c.min_speed_mps and command_ahead < 0.0:
        command_ahead = 0.0
    error = np.array([gap - desired_gap, speed_ahead - speed, acceleration_ahead - acceleration])
    linear, limits = np.empty(mpc.qp.hessian.shape[0]), np.empty(mpc.qp.rows.shape[0])
    assemble(mpc, error, desired_gap, (speed_ahead, acceleration_ahead, command_ahead), c, linear, limits)
    return linear, limits


@kernel
def predictive_command(
    gap: float,
    desired_gap: float,
    speed: float,
    acceleration: float,
    ahead: tuple[float, float, float],
    c: Constants,
    mpc: Mpc,
    multipliers: Vector,
) -> float:
    """The command (m/s2) of one mitigable vehicle for the coming period, before collision avoidance.

    Own gap, desired gap (m), speed and acceleration; `ahead` as in `assemble` with the predecessor's final command.
    `multipliers` (m,) is the start of the dual iteration, overwritten by its end; zeros are always a valid start.
    """
    linear, limits = pose(gap, desired_gap, speed, acceleration, ahead, c, mpc)
    solution, slack = np.empty(linear.shape[0]), np.empty(limits.shape[0])
    for i in range(linear.shape[0]):
        solution[i] = 0.0
        for j in range(linear.shape[0]):
            solution[i] -= mpc.qp.inverse[i, j] * linear[j]
    if slacks(mpc.qp, solution, limits, slack) < 0.0:
        climb_dual(mpc.qp, slack, multipliers, SWEEPS, TOLERANCE)
        constrain(mpc.qp, multipliers, solution)
    return clip(solution[0], c.min_acceleration_mps2, c.max_acceleration_mps2)
