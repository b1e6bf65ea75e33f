"""One quadratic program for a string of vehicles behind a disbanded one, and its solution by operator splitting.

Vehicle i of the string chooses commands u_i over H periods. With the free motion x0, v0 and the responses X, V of one
vehicle (exact for a command that is held), the program is

    min  1/2 sum_i  w_g |gap_i - d_i|^2 + w_r |v_(i-1) - v_i|^2 + w_v |v_i - v_d|^2 + R |u_i|^2
    s.t. u_min <= u_i <= u_max,  v_min <= v_i <= v_top,  gap_i >= least gap

Its matrix is block tridiagonal along the string, with the same blocks for every vehicle but the last. So it is factored
once for a lag, and a solution costs a sweep to the rear and one back. The splitting is that of OSQP (Stellato et al.,
2020) with a cap on the multipliers: beyond it a row gives way, so that there is always a solution. The package itself
takes about three times as long for as many iterations: it does not share the factor among vehicles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import clip, copy, fill, inlined
from cps_envs.core.types import FloatArray

Vector = FloatArray
RELAXATION = 1.6  # of the splitting, as OSQP has it
SAME = 1e-13  # blocks of the factor that differ by less count as equal
PENALTIES = (0.3, 1.0, 30.0)  # of the splitting, for the rows of command, speed and gap; chosen by how fast it ends
# Largest multipliers of these rows. The last one prices a metre below the least gap. It has to outweigh what all the
# vehicles behind want, which adds up along the string: with 30, eighty of them push a leader into the vehicle ahead.
CAPS = (1e3, 1e3, 300.0)


@dataclass(frozen=True)
class JointSettings:
    """Horizon, weights and limits of the program."""

    horizon: int  # H, periods predicted
    period_s: float  # T, for which a command is held in the plan
    command_weight: float  # R
    gap_weight: float  # w_g
    closing_weight: float  # w_r
    speed_weight: float  # w_v
    keeps_headway: bool  # leaders want the gap h v of their law (2.4); otherwise that of all other vehicles
    may_hurry: bool  # speeds up to v_max are allowed; otherwise up to v_d
    least_gap_m: float
    braces: (
        bool  # while attacks may come: leaders keep what they need, beyond that, when the platoon ahead brakes fully
    )
    iterations: int = 1000  # of the splitting, at most
    tolerance: float = 1e-3  # of the residual at which it ends, see `solve_joint`


class JointDesign(NamedTuple):
    """What is constant for one lag; H periods, K blocks until they repeat. A stack of designs has a leading axis."""

    tau_s: Vector  # (1,)
    speed: Vector  # (H, H) V, the speed after period m per command of period j
    speed_columns: Vector  # (H, H) V'
    place: Vector  # (H, H) X, the same of the position
    place_columns: Vector  # (H, H) X'
    coupling: Vector  # (H, H) S, minus the block beside the diagonal
    inverse: Vector  # (K, H, H) of the diagonal's blocks after elimination
    last_inverse: Vector  # (K, H, H) the same where the string ends with this vehicle
    onward_columns: Vector  # (K, H, H) (inverse S)'


class JointScratch(NamedTuple):
    """Scratch arrays for a program of M vehicles. Its rows: the command, the speed and the gap after each period."""

    linear: Vector  # (M, H) the program's linear term
    right: Vector  # (M, H)
    before: Vector  # (M, H)
    low: Vector  # (3, M, H) limits of what the commands add to the rows
    high: Vector  # (3, M, H)
    rows: Vector  # (3, M, H) what they add
    split: Vector  # (3, M, H) the same within the limits
    room: Vector  # (H,)
    more: Vector  # (H,)


@lru_cache(maxsize=512)
def design_joint(settings: JointSettings, tau_s: float, vehicles: int) -> JointDesign:
    """Factor the program for a lag and strings of up to `vehicles`."""
    horizon, period = settings.horizon, settings.period_s
    times = period * np.arange(horizon + 1)
    late = tau_s * (1.0 - np.exp(-times / tau_s))
    speed_step = np.diff(times - late)  # of a command held for the first period, after each period
    place_whole = times**2 / 2.0 - tau_s * (times - late)
    place_step = np.diff(place_whole)
    delay = np.subtract.outer(np.arange(horizon), np.arange(horizon))
    speed = np.where(delay >= 0, speed_step[np.maximum(delay, 0)], 0.0)
    place = np.where(delay >= 0, place_step[np.maximum(delay, 0)], 0.0)
    on_command, on_speed, on_gap = PENALTIES
    own = (settings.command_weight + on_command) * np.eye(horizon)
    own += (settings.speed_weight + on_speed) * speed.T @ speed
    coupling = (settings.gap_weight + on_gap) * place.T @ place + settings.closing_weight * speed.T @ speed
    inverse, last_inverse = [np.linalg.inv(own + 2.0 * coupling)], [np.linalg.inv(own + coupling)]
    while len(inverse) < vehicles:
        eliminated = own - coupling @ inverse[-1] @ coupling
        inverse.append(np.linalg.inv(eliminated + 2.0 * coupling))
        last_inverse.append(np.linalg.inv(eliminated + coupling))
        if np.abs(inverse[-1] - inverse[-2]).max() < SAME:
            break
    onward = [(each @ coupling).T for each in inverse]
    parts = ([tau_s], speed, speed.T, place, place.T, coupling, inverse, last_inverse, onward)
    return JointDesign(*(np.ascontiguousarray(part, dtype=np.float64) for part in parts))


def joint_scratch(vehicles: int, horizon: int) -> JointScratch:
    """Room for programs; it is handed to kernels, so that they can cut it without counting references."""
    flat, deep = (vehicles, horizon), (3, vehicles, horizon)
    shapes: tuple[tuple[int, ...], ...] = (flat, flat, flat, deep, deep, deep, deep, (horizon,), (horizon,))
    return JointScratch(*(np.zeros(shape) for shape in shapes))


@inlined
def add_product(columns: Vector, factor: Vector, out: Vector) -> None:
    """Add a matrix (H, H), given by its columns, times `factor` (H,) to `out` (H,)."""
    for j in range(factor.size):
        weight = factor[j]
        for i in range(out.size):
            out[i] += columns[j, i] * weight


@inlined
def solve_blocks(design: JointDesign, count: int, right: Vector, commands: Vector) -> None:
    """Fill `commands` (M, H) of the first `count` vehicles with the solution for `right` (M, H), which is used up."""
    blocks = design.inverse.shape[0]
    for i in range(count):
        fill(commands[i], 0.0)
        k = min(i, blocks - 1)
        if i < count - 1:
            add_product(design.inverse[k], right[i], commands[i])
            add_product(design.coupling, commands[i], right[i + 1])
        else:
            add_product(design.last_inverse[k], right[i], commands[i])
    for back in range(1, count):
        i = count - 1 - back
        add_product(design.onward_columns[min(i, blocks - 1)], commands[i + 1], commands[i])


@inlined
def solve_joint(
    design: JointDesign,
    count: int,
    commands: Vector,
    multipliers: Vector,
    iterations: int,
    tolerance: float,
    s: JointScratch,
) -> float:
    """Improve the plan of the first `count` vehicles in place; returns the residual that is left.

    It is the largest of what an iteration changes of a command, m/s2, and of what a row is from its split one: m/s2,
    m/s or m. Below `tolerance` it ends.

    `s.linear`, `s.low`, `s.high` describe the program. `commands` (M, H) and `multipliers` (3, M, H) are the start,
    the latter divided by their penalties.
    """
    horizon = commands.shape[1]
    respond(design, count, commands, s)
    for row in range(3):
        for i in range(count):
            for m in range(horizon):
                s.split[row, i, m] = clip(s.rows[row, i, m], s.low[row, i, m], s.high[row, i, m])
    residual = np.inf
    for _ in range(iterations):
        pose_right(design, count, multipliers, s)
        solve_blocks(design, count, s.right, commands)
        change = 0.0
        for i in range(count):
            for m in range(horizon):
                change = max(change, abs(commands[i, m] - s.rows[0, i, m]))
        respond(design, count, commands, s)
        residual = max(change, project(count, multipliers, s))
        if residual < tolerance:
            break
    return residual


@inlined
def project(count: int, multipliers: Vector, s: JointScratch) -> float:
    """Bring the rows within their limits and move the multipliers; returns how far the rows are outside."""
    broken = 0.0
    for row in range(3):
        cap = CAPS[row] / PENALTIES[row]
        for i in range(count):
            for m in range(s.room.size):
                relaxed = RELAXATION * s.rows[row, i, m] + (1.0 - RELAXATION) * s.split[row, i, m]
                relaxed += multipliers[row, i, m]
                outside = relaxed - clip(relaxed, s.low[row, i, m], s.high[row, i, m])
                multipliers[row, i, m] = clip(outside, -cap, cap)
                s.split[row, i, m] = relaxed - multipliers[row, i, m]
                broken = max(broken, abs(s.rows[row, i, m] - s.split[row, i, m]))
    return broken


@inlined
def respond(design: JointDesign, count: int, commands: Vector, s: JointScratch) -> None:
    """Fill `s.rows` with what the commands add."""
    fill(s.more, 0.0)  # to the position ahead
    for i in range(count):
        copy(commands[i], s.rows[0, i])
        fill(s.rows[1, i], 0.0)
        add_product(design.speed_columns, commands[i], s.rows[1, i])
        copy(s.more, s.rows[2, i])
        fill(s.more, 0.0)
        add_product(design.place_columns, commands[i], s.more)
        for m in range(s.more.size):
            s.rows[2, i, m] -= s.more[m]


@inlined
def pose_right(design: JointDesign, count: int, multipliers: Vector, s: JointScratch) -> None:
    """Fill `s.right` for the present split of the rows."""
    horizon = s.room.size
    for i in range(count):
        for m in range(horizon):
            s.right[i, m] = PENALTIES[0] * (s.split[0, i, m] - multipliers[0, i, m]) - s.linear[i, m]
            s.room[m] = PENALTIES[1] * (s.split[1, i, m] - multipliers[1, i, m])
            s.more[m] = -PENALTIES[2] * (s.split[2, i, m] - multipliers[2, i, m])
        if i + 1 < count:
            for m in range(horizon):
                s.more[m] += PENALTIES[2] * (s.split[2, i + 1, m] - multipliers[2, i + 1, m])
        add_product(design.speed, s.room, s.right[i])
        add_product(design.place, s.more, s.right[i])
