"""The kernels of the joint mitigation: predicting the vehicles of an episode, and planning the commands of some."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.disbanding.joint_program import JointDesign, JointScratch, add_product, respond, solve_joint
from cps_envs.core.compute.kernels import borrowed, clip, copy, fill, inlined, kernel, lend, unpack
from cps_envs.core.types import Array, BoolArray, FloatArray
from cps_envs.disbanding.controllers import DEAD_BAND, human_command
from cps_envs.disbanding.dynamics import final_command
from cps_envs.disbanding.state import Constants

REACH_M = 10.0  # a gap counts as no farther than this from the wanted one: the rest is not for the next seconds
SUBSTEP_S = 0.05  # of the prediction of human drivers


class Motions(NamedTuple):
    """How the vehicles of B episodes move now, (B, M), the front one first; a `view` is one episode."""

    position: FloatArray  # m
    speed: FloatArray  # m/s
    acceleration: FloatArray  # m/s2
    law_command: FloatArray  # m/s2, within the limits of the actuators
    disbanded: BoolArray


class Forecast(NamedTuple):
    """Positions (M, H + 1) in m and speeds in m/s from now on, every period, of the vehicles of one episode."""

    position: FloatArray
    speed: FloatArray


class PlanNumbers(NamedTuple):
    """The part of `JointSettings` that kernels need."""

    period_s: float
    gap_weight: float
    closing_weight: float
    speed_weight: float
    keeps_headway: bool
    may_hurry: bool
    least_gap_m: float
    iterations: int
    tolerance: float


@kernel
def plan_episode(
    motions: Motions,
    num_vehicles: int,
    design: JointDesign,
    desired_gap_m: float,
    braces: bool,
    constants: Array,
    knobs: Array,
    prediction: Forecast,
    plan: FloatArray,
    multipliers: FloatArray,
    scratch: JointScratch,
    corrections: FloatArray,
) -> float:
    """Fill `corrections` (M,) in m/s2 of one episode, and renew its `plan` (M, H) and `multipliers` (3, M, H).

    Returns the largest residual of its programs, see `solve_joint`. `braces`: leaders keep the reserve of
    `JointSettings.braces`.
    """
    c, k = unpack(Constants, constants, 0), unpack(PlanNumbers, knobs, 0)
    now, ahead, factors, room = lend(motions), lend(prediction), lend(design), lend(scratch)
    q, residual = 0, 0.0
    while q < num_vehicles and not now.disbanded[q]:
        coast(now, factors, k.period_s, ahead, q)
        q += 1
    while q < num_vehicles:
        if now.disbanded[q]:
            predict_human(now, factors, c, k.period_s, ahead, q)
            q += 1
        else:
            count = 1
            while q + count < num_vehicles and not now.disbanded[q + count]:
                count += 1
            commands, prices = borrowed(plan)[q : q + count], borrowed(multipliers)[:, q : q + count]
            left = plan_string(now, factors, c, k, desired_gap_m, braces, ahead, q, count, commands, prices, room)
            residual = max(residual, left)
            for i in range(q, q + count):
                corrections[i] = correction_for(plan[i, 0], now.law_command[i], c)
            q += count
    return residual


@inlined
def correction_for(command: float, law: float, c: Constants) -> float:
    """The correction (m/s2) that makes a command of the law's, which is not to act itself where it is saturated."""
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    correction = clip(command, low, high) - law
    if abs(correction) < DEAD_BAND and (law <= low or law >= high):
        return DEAD_BAND if law <= low else -DEAD_BAND
    return correction


@inlined
def coast(now: Motions, design: JointDesign, period_s: float, ahead: Forecast, q: int) -> None:
    """Predict vehicle `q` without commands, its acceleration fading with the lag."""
    speed, acceleration, tau_s = now.speed[q], now.acceleration[q], design.tau_s[0]
    for m in range(ahead.speed.shape[1]):
        time_s = m * period_s
        late_s = tau_s * (1.0 - np.exp(-time_s / tau_s))
        ahead.speed[q, m] = speed + acceleration * late_s
        ahead.position[q, m] = now.position[q] + speed * time_s + acceleration * tau_s * (time_s - late_s)


@inlined
def predict_human(now: Motions, design: JointDesign, c: Constants, period_s: float, ahead: Forecast, q: int) -> None:
    """Predict a human driver (2.5) behind the predicted vehicle ahead."""
    substeps = max(1, round(period_s / SUBSTEP_S))
    step_s = period_s / substeps
    decay = np.exp(-step_s / design.tau_s[0])
    position, speed, acceleration = now.position[q], now.speed[q], now.acceleration[q]
    ahead.position[q, 0], ahead.speed[q, 0] = position, speed
    for m in range(1, ahead.speed.shape[1]):
        for substep in range(substeps):
            share = substep / substeps
            gap, speed_ahead = np.inf, speed
            if q > 0:
                before = ahead.position[q - 1, m - 1]
                gap = before + share * (ahead.position[q - 1, m] - before) - position
                before = ahead.speed[q - 1, m - 1]
                speed_ahead = before + share * (ahead.speed[q - 1, m] - before)
            command = human_command(gap, speed, speed_ahead, c.headway_s, c)
            command = final_command(command, gap, speed, speed_ahead, c)
            position += step_s * speed
            speed = clip(speed + step_s * acceleration, c.min_speed_mps, c.max_speed_mps)
            acceleration = clip(
                command + (acceleration - command) * decay, c.min_acceleration_mps2, c.max_acceleration_mps2
            )
            if speed <= c.min_speed_mps:
                acceleration = max(acceleration, 0.0)
        ahead.position[q, m], ahead.speed[q, m] = position, speed


@inlined
def plan_string(
    now: Motions,
    design: JointDesign,
    c: Constants,
    k: PlanNumbers,
    desired_gap_m: float,
    braces: bool,
    ahead: Forecast,
    first: int,
    count: int,
    commands: FloatArray,
    multipliers: FloatArray,
    s: JointScratch,
) -> float:
    """Plan the vehicles from `first` on, behind one whose motion is predicted, and predict their own.

    Returns the residual of the program.
    """
    horizon = commands.shape[1]
    top = c.max_speed_mps if k.may_hurry else c.desired_speed_mps
    for i in range(count):
        q = first + i
        coast(now, design, k.period_s, ahead, q)
        gap = now.position[q - 1] - now.position[q]
        leads = q % c.vehicles_per_platoon == 0
        least = k.least_gap_m
        if leads and braces:  # who brakes as hard, but later, comes nearer by what it travels meanwhile
            least += (design.tau_s[0] + c.period_steps * c.dt_s) * now.speed[q]
        wanted = c.headway_s * now.speed[q] if leads and k.keeps_headway else max(desired_gap_m, least)
        wanted = max(wanted, gap - REACH_M)
        fill(s.linear[i], 0.0)
        for m in range(horizon):
            speed = ahead.speed[q, m + 1]
            free_gap = ahead.position[q - 1, m + 1] - ahead.position[q, m + 1]
            s.room[m] = -k.gap_weight * (free_gap - wanted)
            s.more[m] = k.speed_weight * (speed - c.desired_speed_mps)
            s.right[i, m] = -k.closing_weight * (ahead.speed[q - 1, m + 1] - speed)
            s.low[0, i, m], s.high[0, i, m] = c.min_acceleration_mps2, c.max_acceleration_mps2
            s.low[1, i, m], s.high[1, i, m] = min(c.min_speed_mps - speed, 0.0), max(top - speed, 0.0)
            s.low[2, i, m], s.high[2, i, m] = least - free_gap, np.inf
        add_product(design.speed, s.right[i], s.linear[i])
        add_product(design.place, s.room, s.linear[i])
        if i > 0:  # the vehicle ahead moves the same gap, the other way
            for m in range(horizon):
                s.linear[i - 1, m] -= s.linear[i, m]
        add_product(design.speed, s.more, s.linear[i])
    residual = solve_joint(design, count, commands, multipliers, k.iterations, k.tolerance, s)
    for i in range(count):
        for m in range(horizon):
            commands[i, m] = clip(commands[i, m], c.min_acceleration_mps2, c.max_acceleration_mps2)
    respond(design, count, commands, s)
    for i in range(count):
        q = first + i
        copy(s.rows[1, i], s.room)
        fill(s.more, 0.0)
        add_product(design.place_columns, commands[i], s.more)
        for m in range(horizon):
            ahead.speed[q, m + 1] += s.room[m]
            ahead.position[q, m + 1] += s.more[m]
    return residual
