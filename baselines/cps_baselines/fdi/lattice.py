"""Combinations of whole variables that span a thin polytope in few values: Lenstra's way to integer programs.

The solutions that beat the best one known lie in a polytope with a small volume, but long in directions that mix
neighbouring steps (a level more now, one less in the next step), so that fixing variables one by one prunes late. In
the metric of the ellipsoid around the polytope's analytic centre, a reduced basis of the dual lattice (Lenstra, Lenstra
and Lovasz 1982, with the deep insertions of Schnorr and Euchner 1994) has the directions in which it is thinnest. Their
values are the new variables: whole where the old ones are, one to one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from cps_baselines.fdi.highs import INFEASIBLE, Program, solve
from cps_baselines.fdi.lifted import NEGLIGIBLE, Rows, stack
from cps_envs.core.compute.kernels import inlined, kernel
from cps_envs.core.types import BoolArray, FloatArray

DELTA = 0.999  # of the reduction: 1 is the strongest
MOST_INSERTIONS = 200_000  # a reduction that takes longer stops; what it has is a basis as well
EMPTY = 1e-6  # a polytope is empty where every point breaks a row by this much of its norm
FLAT = 1e-9  # one whose largest ball is smaller has no metric
CENTRED = 1e-3  # Newton decrement of the analytic centre
NEWTON_STEPS = 200
FAR = 1e4  # no variable is larger


class Reduced(NamedTuple):
    """A program in new variables w (columns,), those of the thinnest directions first; y = transform @ w."""

    program: Program
    transform: FloatArray  # (columns, columns), whole with a whole inverse


def polytope(program: Program, limit: float) -> tuple[FloatArray, FloatArray]:
    """A (rows, columns), b (rows,) with A y <= b: all that a program demands, and an objective of at most `limit`."""
    matrix, identity = program.rows.matrix.toarray(), np.eye(len(program.cost))
    left = np.vstack([matrix, -matrix, identity, -identity, program.cost[np.newaxis]])
    right = np.concatenate([program.rows.upper, -program.rows.lower, program.upper, -program.lower, [limit]])
    kept = np.isfinite(right) & (np.abs(left).max(axis=1) > NEGLIGIBLE)
    return left[kept], right[kept]


def is_empty(left: FloatArray, right: FloatArray) -> bool:
    """Whether no y satisfies left @ y <= right, by more than a solver's tolerance."""
    _, radius = _inside(left, right)
    return radius < -EMPTY


def reduced(program: Program, passive: BoolArray, limit: float) -> Reduced | None:
    """The program in the reduced basis of its solutions with an objective of at most `limit`; None: they are flat.

    `passive` (columns,) marks variables that stay as they are.
    """
    left, right = polytope(program, limit)
    start, radius = _inside(left, right)
    if radius <= FLAT:
        return None
    metric = _metric(left, right, start)
    active, rest = np.flatnonzero(~passive), np.flatnonzero(passive)
    inner = metric[np.ix_(active, active)]
    if len(rest):
        inner = inner - metric[np.ix_(active, rest)] @ np.linalg.solve(
            metric[np.ix_(rest, rest)], metric[np.ix_(rest, active)]
        )
    dual = np.linalg.inv(inner)
    basis = reduce_basis((dual + dual.T) / np.abs(2 * dual).max())
    size = len(program.cost)
    transform, inverse = np.eye(size), np.eye(size)
    transform[np.ix_(active, active)] = np.rint(np.linalg.inv(basis))
    inverse[np.ix_(active, active)] = basis
    if not np.array_equal(transform @ inverse, np.eye(size)):
        return None
    order = np.concatenate([active, rest])
    return _renamed(program, transform[:, order], inverse[order])


def _renamed(program: Program, transform: FloatArray, inverse: FloatArray) -> Reduced:
    """A program in w = inverse @ y; the bounds of y become rows."""
    drift = np.zeros((len(program.cost), program.rows.drift.shape[1]))
    box = Rows(sparse.csr_matrix(transform), program.lower, program.upper, drift)
    rows = stack([program.rows._replace(matrix=sparse.csr_matrix(program.rows.matrix @ transform)), box])
    largest = np.abs(inverse) @ np.maximum(np.abs(program.lower), np.abs(program.upper))
    cost = transform.T @ program.cost
    return Reduced(replace(program, cost=cost, rows=rows, lower=-largest, upper=largest), transform)


def _inside(left: FloatArray, right: FloatArray) -> tuple[FloatArray, float]:
    """The centre (columns,) of the largest ball in a polytope, and its radius, below 0 where there is none."""
    norms, size = np.linalg.norm(left, axis=1), left.shape[1]
    matrix = sparse.csr_matrix(np.hstack([left, norms[:, np.newaxis]]))
    rows = Rows(matrix, np.full(len(right), -np.inf), right, np.zeros((len(right), 1)))
    widest = np.append(np.full(size, FAR), FAR)
    found = solve(Program(np.append(np.zeros(size), -1.0), rows, -widest, widest))
    if found.status == INFEASIBLE or found.columns is None:
        return np.zeros(size), -np.inf
    return found.columns[:-1], float(found.columns[-1])


def _metric(left: FloatArray, right: FloatArray, start: FloatArray) -> FloatArray:
    """The Hessian (columns, columns) of the logarithmic barrier at the analytic centre; `start` lies inside."""
    point = start
    for _ in range(NEWTON_STEPS):
        weights = 1 / (right - left @ point)
        hessian: FloatArray = (left * (weights * weights)[:, np.newaxis]).T @ left
        step = -np.linalg.solve(hessian, left.T @ weights)
        decrement = float(np.sqrt(max(0.0, float(step @ hessian @ step))))
        if decrement < CENTRED:
            break
        point = point + step / (1 + decrement)
    return hessian


@kernel
def reduce_basis(gram: FloatArray) -> FloatArray:
    """Whole combinations (n, n), one a row, that are a reduced basis in the metric `gram` (n, n)."""
    size = len(gram)
    whole = np.eye(size)
    basis = np.linalg.cholesky(gram).astype(np.float64)
    upright, squares, shares = np.zeros((size, size)), np.zeros(size), np.zeros((size, size))
    for row in range(size):
        _straighten(basis, upright, squares, shares, row)
    row, count = 1, 0
    while row < size and count < MOST_INSERTIONS:
        count += 1
        _shorten(basis, whole, upright, squares, shares, row)
        _straighten(basis, upright, squares, shares, row)
        place, left = row, basis[row] @ basis[row]
        for earlier in range(row):
            if left < DELTA * squares[earlier]:
                place = earlier
                break
            left -= shares[row, earlier] * shares[row, earlier] * squares[earlier]
        if place == row:
            row += 1
            continue
        moved, moved_whole = basis[row].copy(), whole[row].copy()
        for later in range(row, place, -1):
            basis[later], whole[later] = basis[later - 1], whole[later - 1]
        basis[place], whole[place] = moved, moved_whole
        for later in range(place, row + 1):
            _straighten(basis, upright, squares, shares, later)
        row = max(place, 1)
    return whole


@inlined
def _straighten(basis: FloatArray, upright: FloatArray, squares: FloatArray, shares: FloatArray, row: int) -> None:
    """Gram-Schmidt of one row, twice for accuracy."""
    rest = basis[row].copy()
    for earlier in range(row):
        shares[row, earlier] = (basis[row] @ upright[earlier]) / squares[earlier]
        rest -= shares[row, earlier] * upright[earlier]
    for earlier in range(row):
        rest -= (rest @ upright[earlier]) / squares[earlier] * upright[earlier]
    upright[row] = rest
    squares[row] = rest @ rest


@inlined
def _shorten(
    basis: FloatArray, whole: FloatArray, upright: FloatArray, squares: FloatArray, shares: FloatArray, row: int
) -> None:
    """Take whole multiples of earlier rows off one, until none helps."""
    for _ in range(3):
        changed = False
        for earlier in range(row):
            shares[row, earlier] = (basis[row] @ upright[earlier]) / squares[earlier]
        for earlier in range(row - 1, -1, -1):
            times = np.rint(shares[row, earlier])
            if times != 0.0:
                changed = True
                basis[row] -= times * basis[earlier]
                whole[row] -= times * whole[earlier]
                for before in range(earlier):
                    shares[row, before] -= times * shares[earlier, before]
                shares[row, earlier] -= times
        if not changed:
            break
