"""The model-predictive mitigation of appendix A with corrected signs, for one vehicle that follows another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_baselines.disbanding.quadratic_program import (
    SWEEPS,
    TOLERANCE,
    QuadraticProgram,
    climb_dual,
    constrain,
    quadratic_program,
    slacks,
    unconstrained,
)
from cps_envs.core.compute.kernels import clip, inlined, view
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.disbanding.state import Constants

Vector = FloatArray


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


class HorizonModel(NamedTuple):
    """The model of one vehicle behind another over H periods, for one lag and one set of weights.

    Predicted errors, stacked over the horizon: error_response e + command_response u_p + (effect of U). A stack of B
    designs has a leading axis.
    """

    period_s: Vector  # (1,)
    tau_s: Vector  # (1,)
    error_response: Vector  # (3H, 3) Abar
    command_response: Vector  # (3H,) Bbar2 times ones
    linear_error: Vector  # (H, 3) f per error
    linear_command: Vector  # (H,) f per command ahead


class Mpc(NamedTuple):
    """Everything constant for one lag and one set of weights, or stacked for B of them; m = 5 H - 4 rows.

    Rows: gap >= 0 from period 3, speed within its limits from period 2 (before, U has no effect), u within its limits.
    """

    model: HorizonModel
    qp: QuadraticProgram  # M2 and the rows


class OwnMotion(NamedTuple):
    """What a vehicle measures of itself."""

    gap: float  # m
    desired_gap: float  # m
    speed: float  # m/s
    acceleration: float  # m/s2


class Preceding(NamedTuple):
    """What a vehicle knows of the one ahead."""

    speed: float  # m/s
    acceleration: float  # m/s2
    command: float  # m/s2, the final one


class MpcScratch(NamedTuple):
    """Scratch arrays for solving one program."""

    error: Vector  # (3,)
    linear: Vector  # (H,) f
    solution: Vector  # (H,) U
    limits: Vector  # (m,) w
    slack: Vector  # (m,)
    positive: IntArray  # (m,)


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
    responses = error_response, command_response, linear_error, linear_command
    return Mpc(HorizonModel(np.array([period]), np.array([tau_s]), *responses), qp)


def stack_mpc(settings: MpcSettings, taus_s: Vector) -> Mpc:
    """The designs for the lags (B,) of all episodes; ValueError as `design_mpc`."""
    designs = [design_mpc(settings, float(tau_s)) for tau_s in taus_s]
    model = HorizonModel(*map(np.stack, zip(*(design.model for design in designs), strict=True)))
    flat = model._replace(period_s=model.period_s[:, 0], tau_s=model.tau_s[:, 0])
    return Mpc(flat, QuadraticProgram(*map(np.stack, zip(*(design.qp for design in designs), strict=True))))


@inlined
def design_of(stack: Mpc, b: int) -> Mpc:
    """Design `b` of a stack."""
    return Mpc(view(stack.model, b), view(stack.qp, b))


@inlined
def mpc_scratch(stack: Mpc) -> MpcScratch:
    """Room for solving the programs of a stack one after the other; kernels make it once per call."""
    rows, horizon = stack.qp.rows.shape[1], stack.qp.rows.shape[2]
    vectors = np.empty(3), np.empty(horizon), np.empty(horizon), np.empty(rows), np.empty(rows)
    return MpcScratch(vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], np.empty(rows, np.int64))


@inlined
def assemble(
    model: HorizonModel,
    error: Vector,
    desired_gap: float,
    ahead: Preceding,
    c: Constants,
    linear: Vector,
    limits: Vector,
) -> None:
    """Fill the linear term f (H,) and the limits w (m,) of the program of one vehicle at one time.

    `error` (3,) = (gap - desired gap in m, speed ahead - own in m/s, acceleration ahead - own in m/s2). The
    predecessor's speed is predicted by Euler.
    """
    horizon = linear.size
    period_s, tau_s = model.period_s[0], model.tau_s[0]
    speed, acceleration, command = ahead.speed, ahead.acceleration, ahead.command
    for m in range(horizon):
        linear[m] = model.linear_command[m] * command
        for k in range(3):
            linear[m] += model.linear_error[m, k] * error[k]
        limits[3 * horizon - 4 + m] = c.max_acceleration_mps2
        limits[4 * horizon - 4 + m] = -c.min_acceleration_mps2
        speed += period_s * acceleration
        acceleration += period_s * (command - acceleration) / tau_s
        if m >= 2:
            limits[m - 2] = desired_gap + free_error(model, 3 * m, error, command)
        if m >= 1:
            closing = free_error(model, 3 * m + 1, error, command)
            limits[horizon - 3 + m] = c.max_speed_mps - speed + closing
            limits[2 * horizon - 4 + m] = speed - c.min_speed_mps - closing


@inlined
def free_error(model: HorizonModel, row: int, error: Vector, command: float) -> float:
    """Row `row` of the stacked errors predicted for U = 0."""
    value: float = model.command_response[row] * command
    for k in range(3):
        value += model.error_response[row, k] * error[k]
    return value


@inlined
def pose(own: OwnMotion, ahead: Preceding, c: Constants, model: HorizonModel, room: MpcScratch) -> None:
    """Fill the linear term and the limits of one vehicle's program."""
    command = clip(ahead.command, c.min_acceleration_mps2, c.max_acceleration_mps2)
    if ahead.speed <= c.min_speed_mps and command < 0.0:
        command = 0.0
    room.error[0] = own.gap - own.desired_gap
    room.error[1] = ahead.speed - own.speed
    room.error[2] = ahead.acceleration - own.acceleration
    bounded = Preceding(ahead.speed, ahead.acceleration, command)
    assemble(model, room.error, own.desired_gap, bounded, c, room.linear, room.limits)


@inlined
def predictive_command(
    own: OwnMotion, ahead: Preceding, c: Constants, mpc: Mpc, multipliers: Vector, room: MpcScratch
) -> float:
    """The command (m/s2) of one mitigable vehicle for the coming period, before collision avoidance.

    `multipliers` (m,) is the start of the dual iteration, overwritten by its end; zeros are always a valid start.
    """
    pose(own, ahead, c, mpc.model, room)
    solution = room.solution
    unconstrained(mpc.qp, room.linear, solution)
    if slacks(mpc.qp, solution, room.limits, room.slack) < 0.0:
        climb_dual(mpc.qp, room.slack, multipliers, room.positive, SWEEPS, TOLERANCE)
        constrain(mpc.qp, multipliers, solution)
    return clip(solution[0], c.min_acceleration_mps2, c.max_acceleration_mps2)
