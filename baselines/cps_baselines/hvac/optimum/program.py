"""The strongest stealthy attack on MTD2: a convex quadratic is maximised over an intersection of ellipsoids.

Needs the extra `convex`. The local optimum comes by sequential linearisation, each step a second-order cone program.
The bound is Shor's relaxation of the same problem, a semidefinite program; it holds for the mean field and its knots.
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np

from cps_baselines.hvac.optimum.response import Response
from cps_baselines.optional import optional
from cps_envs.core.types import FloatArray

ROUNDS, SETTLED = 30, 1e-6
TYPICAL_C = 10.0  # the relaxation's unit of a bias, so that its numbers are near 1
EVERY = 4  # steps between residuals that the bound takes into account: leaving some out only raises it
GROWTH = 10.0 ** np.arange(-12, 4)  # by which multipliers grow until they certify


class Optimum(NamedTuple):
    """An attack, what it does in the mean field, and what none of its kind can exceed."""

    b: FloatArray  # (p,)
    impact_c2: float
    bound_c2: float


class Quadratic(NamedTuple):
    """Maximise z'Wz over z = (b, 1) with b'F_k b <= 1 for all k."""

    objective: FloatArray  # W (p + 1, p + 1)
    forms: FloatArray  # F (k, p, p)


def solve(response: Response) -> Optimum:
    """The attack that sequential linearisation finds from the relaxation's leading direction, and the bound.

    Raises:
        MissingExtraError: cvxpy is not installed.
    """
    cp = optional("cvxpy", install='"cps-envs[convex]"', purpose="the optimal stealthy attack")
    problem = quadratic(response)
    start, multipliers = relaxed(cp, problem)
    b = refined(cp, response, start)
    return Optimum(b, response.impact(b), certified(problem, multipliers))


def quadratic(response: Response) -> Quadratic:
    """The problem in the unit `TYPICAL_C`, with the A_impact as its objective."""
    count, steps, q, _ = response.gram[:, ::EVERY].shape
    W, shift = np.empty((count * q + 1, count * q + 1)), TYPICAL_C * response.shift
    W[:-1, :-1], W[:-1, -1] = shift.T @ shift, shift.T @ response.error
    W[-1, :-1], W[-1, -1] = W[:-1, -1], response.error @ response.error
    forms = np.zeros((count, steps, count * q, count * q))
    for place in range(count):
        part = slice(place * q, (place + 1) * q)
        room = response.room[place, ::EVERY, np.newaxis, np.newaxis]
        forms[place, :, part, part] = TYPICAL_C**2 * response.gram[place, ::EVERY] / room
    return Quadratic(W / response.states, forms.reshape(-1, count * q, count * q))


def relaxed(cp: Any, problem: Quadratic) -> tuple[FloatArray, FloatArray]:
    """The leading direction (p,) of Shor's relaxation, and the multipliers (k,) of its constraints."""
    p, scale = problem.forms.shape[1], np.abs(problem.objective).max()
    lifted = cp.Variable((p + 1, p + 1), PSD=True)
    within = problem.forms.reshape(-1, p * p) @ cp.vec(lifted[:p, :p], order="C") <= 1.0
    program = cp.Problem(cp.Maximize(cp.trace(problem.objective / scale @ lifted)), [within, lifted[p, p] == 1])
    with warnings.catch_warnings():  # about its accuracy: `certified` needs none
        warnings.simplefilter("ignore", UserWarning)
        program.solve(solver=cp.CLARABEL)
    leading = np.linalg.eigh(lifted.value[:p, :p])[1][:, -1]
    return leading * np.sign(problem.objective[:p, p] @ leading), scale * np.asarray(within.dual_value)


def certified(problem: Quadratic, multipliers: FloatArray) -> float:
    """An upper bound by weak duality, whatever the multipliers (k,) are: no accuracy of a solver enters.

    With M = W - sum of l_k F_k for l >= 0, z'Wz <= sum of l_k + z'Mz. That is at most the sum plus the Schur complement
    of M, where its part without the 1 is negative definite. The multipliers grow until it is; infinity if it never is.
    """
    known = np.maximum(multipliers, 0.0)
    for growth in GROWTH:
        weights = known + growth * (known + known.max())
        M = problem.objective.copy()
        M[:-1, :-1] -= np.tensordot(weights, problem.forms, 1)
        if np.linalg.eigvalsh(M[:-1, :-1]).max() < 0.0:
            return float(weights.sum() + M[-1, -1] - M[-1, :-1] @ np.linalg.solve(M[:-1, :-1], M[:-1, -1]))
    return np.inf


def refined(cp: Any, response: Response, start: FloatArray) -> FloatArray:
    """The biases (p,), C, at which the linearised impact has its maximum, all of them within the room."""
    count, q = response.gram.shape[0], response.gram.shape[2]
    b, slope = cp.Variable(count * q), cp.Parameter(count * q)
    limits = []
    for place in range(count):
        roots = _roots(response.gram[place] / response.room[place][:, np.newaxis, np.newaxis])  # (k, q, q)
        stretched = roots.reshape(-1, q) @ b[place * q : (place + 1) * q]
        limits.append(cp.norm(cp.reshape(stretched, (len(roots), q), order="C"), axis=1) <= 1.0)
    problem = cp.Problem(cp.Maximize(slope @ b), limits)
    found: FloatArray = TYPICAL_C * start / np.abs(start).max()
    impact = -np.inf
    for _ in range(ROUNDS):
        gradient = response.shift.T @ (response.error + response.shift @ found)
        slope.value = gradient / np.abs(gradient).max()
        problem.solve(solver=cp.CLARABEL)
        found = np.asarray(b.value)
        if response.impact(found) <= impact * (1.0 + SETTLED):
            break
        impact = response.impact(found)
    return found


def _roots(forms: FloatArray) -> FloatArray:
    """R with R'R = form of each positive semidefinite form (k, q, q)."""
    values, vectors = np.linalg.eigh(forms)
    roots: FloatArray = np.sqrt(np.maximum(values, 0.0))[:, :, np.newaxis] * vectors.transpose(0, 2, 1)
    return roots
