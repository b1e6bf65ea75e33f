"""The controller (4.17) with its limits: N steps of heating, each within its plant's, by a quadratic program.

The cost (4.8) with Q = I and R = `move_weight` I is minimised over the absolute heating U = (u(k), ..., u(k + N - 1)).
What x(k), dx(k) and the heating before leave unexplained is taken to stay: x(l + 1) = A x(l) + B u(l) + G w(l) + v with
v = xh(k) - A (xh(k) - dxh(k)) - B u(k - 1) - G w(k - 1), which is (4.12).

The method is Bertsekas' projected Newton method: where a limit holds against the slope, the heating stays;
for the rest Newton's step is exact, found by a recursion over the steps as for a linear regulator; the result is cut to
the limits, and shortened until the cost falls enough. Begun with the plan of the step before, shifted by one, it takes
two to four rounds. It ends when a slope step cut to the limits, u - clip(u - slope / 2R, least, E), is nowhere above
`TOLERANCE_W`: zero there is the condition of optimality (Karush, Kuhn, Tucker).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import clip, copy, fill, inlined, maker, room
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.state import State

TOLERANCE_W = 1e-8
ROUNDS = 100  # of Newton's step; tests need fewer than 30
HALVINGS = 30
ENOUGH = 1e-4  # of the fall in cost that the slope promises (Armijo)


class Desk(NamedTuple):
    """Scratch arrays for one plan of N steps of n zones; without rows where the controller does not plan."""

    path: FloatArray  # (N, n) C, x(k + 1) .. x(k + N) under a plan
    slope: FloatArray  # (N, n) C2/W, of the cost by each heating
    held: BoolArray  # (N, n) the heating stays at its limit
    step: FloatArray  # (N, n) W, Newton's
    trial: FloatArray  # (N, n) W, a plan
    inverse: FloatArray  # (N, n, n) W2/C2, of the curvature by the heatings of a step that are not held; 0 for the rest
    gain: FloatArray  # (N, n, n) W/C, minus the answer of a step's heating to the temperatures before it
    linear: FloatArray  # (N, n) C2/W, half the slope by a step's heating, with what follows from it
    rest: FloatArray  # (n,) C, v
    curvature: FloatArray  # (n, n) C2/W2, by the heating of one step with what follows from it
    by_both: FloatArray  # (n, n)
    value: (
        FloatArray  # (3, n, n) of what is still to come: by temperatures, by them and the heating before, by the latter
    )
    slopes: FloatArray  # (2, n) the same, linear: half of them by temperatures, and by the heating before
    room: FloatArray  # (2, n, n)
    vector: FloatArray  # (2, n)


@maker
def make_desk(steps: int, n: int) -> Desk:
    """Room for a call of a kernel, its contents of no meaning; N steps, or 0 where the controller does not plan."""
    size = n if steps > 0 else 0
    return Desk(
        path=room((steps, n)),
        slope=room((steps, n)),
        held=room((steps, n), np.bool_),
        step=room((steps, n)),
        trial=room((steps, n)),
        inverse=room((steps, n, n)),
        gain=room((steps, n, n)),
        linear=room((steps, n)),
        rest=room(size),
        curvature=room((size, size)),
        by_both=room((size, size)),
        value=room((3, size, size)),
        slopes=room((2, size)),
        room=room((2, size, size)),
        vector=room((2, size)),
    )


@inlined
def plan(model: Model, rules: Rules, episode: State, change: FloatArray, desk: Desk) -> None:
    """Renew `episode.plan` (N, n) W for xh(k), which the controller was fed, and dxh(k), both (n,) C."""
    shift(model, episode.plan)
    see_rest(model, episode, change, desk.rest)
    cost = foresee(model, rules, episode, episode.plan, desk)
    for _ in range(ROUNDS):
        if mark_held(model, rules, episode, desk) <= TOLERANCE_W:
            return
        look_back(model, rules, desk)
        look_ahead(model, rules, desk)
        better = walk(model, rules, episode, desk, cost)
        if better == cost:
            return  # as near as rounding allows
        cost = better


@inlined
def shift(model: Model, planned: FloatArray) -> None:
    """Move a plan ahead by a step; its last one is repeated."""
    for t in range(len(planned) - 1):
        for i in range(planned.shape[1]):
            planned[t, i] = clip(planned[t + 1, i], model.least_w[i], model.most_w[i])


@inlined
def see_rest(model: Model, episode: State, change: FloatArray, rest: FloatArray) -> None:
    """Fill `rest` (n,) with v."""
    before = model.weather[max(episode.first[0] + episode.step[0] - 1, 0)]
    for i in range(len(rest)):
        rest[i] = episode.fed[i] - model.B[i] * episode.integrator[i] - model.G[i] * before[i]
        for j in range(len(rest)):
            rest[i] -= model.A[i, j] * (episode.fed[j] - change[j])


@inlined
def foresee(model: Model, rules: Rules, episode: State, planned: FloatArray, desk: Desk) -> float:
    """Fill the path under a plan (N, n) and return its cost (4.8), C2."""
    cost, now = 0.0, episode.first[0] + episode.step[0]
    for t in range(len(planned)):
        x, reached, w = desk.path[t - 1] if t > 0 else episode.fed, desk.path[t], model.weather[now + t]
        wanted = model.reference[now + t + 1]
        before = planned[t - 1] if t > 0 else episode.integrator
        for i in range(len(x)):
            total = model.B[i] * planned[t, i] + model.G[i] * w[i] + desk.rest[i]
            for j in range(len(x)):
                total += model.A[i, j] * x[j]
            reached[i] = total
            cost += (total - (wanted[i] + episode.shift[i])) ** 2 + rules.move_weight * (planned[t, i] - before[i]) ** 2
    return cost


@inlined
def mark_held(model: Model, rules: Rules, episode: State, desk: Desk) -> float:
    """Fill slope and `held` at the episode's plan, whose path is there; returns the largest cut slope step, W."""
    planned, costate = episode.plan, desk.vector
    fill(costate[0], 0.0)
    worst, last, now = 0.0, len(planned) - 1, episode.first[0] + episode.step[0]
    for back in range(len(planned)):
        t = last - back
        before, wanted = planned[t - 1] if t > 0 else episode.integrator, model.reference[now + t + 1]
        for i in range(planned.shape[1]):
            total = 2.0 * (desk.path[t, i] - (wanted[i] + episode.shift[i]))
            for j in range(planned.shape[1]):
                total += model.A[j, i] * costate[0, j]
            costate[1, i] = total
        copy(costate[1], costate[0])
        for i in range(planned.shape[1]):
            u = planned[t, i]
            moved = u - before[i]
            if t < last:
                moved -= planned[t + 1, i] - u
            slope = model.B[i] * costate[0, i] + 2.0 * rules.move_weight * moved
            desk.slope[t, i] = slope
            desk.held[t, i] = (u <= model.least_w[i] and slope > 0.0) or (u >= model.most_w[i] and slope < 0.0)
            wanted = clip(u - slope / (2.0 * rules.move_weight), model.least_w[i], model.most_w[i])
            worst = max(worst, abs(u - wanted))
    return worst


@inlined
def look_back(model: Model, rules: Rules, desk: Desk) -> None:
    """From the last step to the first: how the cost of all that follows depends on where a step begins.

    With P, S, T of `value` and a, b of `slopes` it is x'P x + 2 x'S p + p'T p + 2 x'a + 2 p'b, x being the change of
    the temperatures and p that of the heating before. The step's own heating q is free where it is not held; with
    M = I + P its curvature is Z = B M B + B S + S'B + T + R, and it meets F = (B M + S') A and c = B a + b + slope/2.
    """
    n, R = model.A.shape[1], rules.move_weight
    P, S, T = desk.value[0], desk.value[1], desk.value[2]
    a, b, MA, F, Z = desk.slopes[0], desk.slopes[1], desk.room[0], desk.by_both, desk.curvature
    fill(desk.value.reshape(-1), 0.0)
    fill(desk.slopes.reshape(-1), 0.0)
    for back in range(len(desk.slope)):
        t = len(desk.slope) - 1 - back
        K, gain, c = desk.inverse[t], desk.gain[t], desk.linear[t]
        for i in range(n):
            P[i, i] += 1.0
            c[i] = model.B[i] * a[i] + b[i] + 0.5 * desk.slope[t, i]
        for i in range(n):
            for j in range(n):
                Z[i, j] = model.B[i] * (P[i, j] * model.B[j] + S[i, j]) + S[j, i] * model.B[j] + T[i, j]
                total, crossed = 0.0, 0.0
                for m in range(n):
                    total += P[i, m] * model.A[m, j]
                    crossed += S[m, i] * model.A[m, j]
                MA[i, j] = total
                F[i, j] = model.B[i] * total + crossed
            Z[i, i] += R
        invert(Z, desk.held[t], K)
        for i in range(n):
            for j in range(n):
                total = 0.0
                for m in range(n):
                    total += K[i, m] * F[m, j]
                gain[i, j] = total
        for i in range(n):
            total, kept = 0.0, 0.0
            for m in range(n):
                total += model.A[m, i] * a[m] - gain[m, i] * c[m]
                kept += K[i, m] * c[m]
            desk.vector[0, i], desk.vector[1, i] = total, R * kept
            for j in range(n):
                total = 0.0
                for m in range(n):
                    total += model.A[m, i] * MA[m, j] - F[m, i] * gain[m, j]
                P[i, j] = total
                S[i, j] = R * gain[j, i]
                T[i, j] = (R if i == j else 0.0) - R * R * K[i, j]
        copy(desk.vector[0], a)
        copy(desk.vector[1], b)


@inlined
def invert(Z: FloatArray, held: BoolArray, inverse: FloatArray) -> None:
    """Fill `inverse` (n, n) with that of the rows and columns of Z that are not held, by sweeps; 0 for the others."""
    n = len(held)
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 0.0 if held[i] or held[j] else -Z[i, j]
    for m in range(n):
        if held[m]:
            continue
        pivot = 1.0 / inverse[m, m]
        for i in range(n):
            if i != m:
                for j in range(n):
                    if j != m:
                        inverse[i, j] -= inverse[i, m] * inverse[m, j] * pivot
        for i in range(n):
            if i != m:
                inverse[i, m] *= pivot
                inverse[m, i] *= pivot
        inverse[m, m] = -pivot


@inlined
def look_ahead(model: Model, rules: Rules, desk: Desk) -> None:
    """Fill Newton's step by what `look_back` found: q = -K (F x + c - R p), from x = 0 and p = 0 on."""
    n, x, reached = model.A.shape[1], desk.vector[0], desk.vector[1]
    fill(x, 0.0)
    for t in range(len(desk.step)):
        for i in range(n):
            total = 0.0
            for j in range(n):
                p = desk.step[t - 1, j] if t > 0 else 0.0
                total -= desk.gain[t, i, j] * x[j] + desk.inverse[t, i, j] * (desk.linear[t, j] - rules.move_weight * p)
            desk.step[t, i] = total
        for i in range(n):
            total = model.B[i] * desk.step[t, i]
            for j in range(n):
                total += model.A[i, j] * x[j]
            reached[i] = total
        copy(reached, x)


@inlined
def walk(model: Model, rules: Rules, episode: State, desk: Desk, cost: float) -> float:
    """Take Newton's step, cut to the limits, or the first half, quarter, ... that lowers the cost; returns the cost."""
    share, planned = 1.0, episode.plan
    for _ in range(HALVINGS):
        promised = 0.0
        for t in range(len(planned)):
            for i in range(planned.shape[1]):
                desk.trial[t, i] = clip(planned[t, i] + share * desk.step[t, i], model.least_w[i], model.most_w[i])
                promised += desk.slope[t, i] * (planned[t, i] - desk.trial[t, i])
        reached = foresee(model, rules, episode, desk.trial, desk)
        if reached <= cost - ENOUGH * promised:
            copy(desk.trial.reshape(-1), planned.reshape(-1))
            return reached
        share *= 0.5
    return cost
