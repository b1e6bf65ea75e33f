"""Proofs of optimality by exhaustive search: whole numbers one by one, each within what linear programs leave to it.

A branch fixes the variables of a program in a fixed order. The range of the next one, under what is fixed and a speed
that has to be beaten, is that of two linear programs. The variables decide how large the tree is, so that it is
measured first: random descents estimate its size (Knuth 1975, Estimating the efficiency of backtrack programs). The
combinations of a reduced basis (`cps_baselines.fdi.lattice`), the thinnest first, are mostly best; sometimes the
variables themselves, the last injections first. Descents through the middle of the ranges look for something better
before the proof, which a higher speed to beat makes shorter.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy import sparse

from cps_baselines.fdi.highs import Program, highspy, load
from cps_baselines.fdi.lattice import Reduced, is_empty, polytope, reduced
from cps_baselines.fdi.lifted import Rows, stack
from cps_envs.core.types import BoolArray, FloatArray, IntArray

FASTER_MPS = 1e-5  # by which an attack has to beat the best one, and which a proof leaves open
ROUNDING = 1e-6  # of the ends of ranges, which are whole
DESCENTS = 30  # for an estimate
PASSES = 3  # over all variables, to narrow their ranges
CLEARLY = 5.0  # times smaller has a tree of the variables themselves to be, to be searched
DIVES = 0.2  # of the time that is left, for descents before the proof
SPREAD, LEAST_SPREAD = 0.25, 0.2  # of a descent around the middle, in half ranges and in whole numbers

Judge = Callable[[FloatArray], float | None]  # the speed (m/s) of a solution (columns,) that replays


class EnumerationOutcome(NamedTuple):
    """What an exhaustive search found."""

    finished: bool  # nothing is left to search
    best: FloatArray | None  # (columns,) faster than what was known; None if there was nothing
    bound_mps: float  # no attack is faster, where the search finished
    nodes: int


def exhaust(
    program: Program, passive: BoolArray, best_mps: float, judge: Judge, time_limit_s: float
) -> EnumerationOutcome:
    """Search all solutions of a program whose speed, minus the objective, exceeds `best_mps` (below 0: all).

    `passive` (columns,) marks variables that no other row shares once the others are fixed: their order is free, and
    any whole value within their range will do.
    """
    deadline, generator = time.thread_time() + time_limit_s, np.random.default_rng(0)
    active, rest = np.flatnonzero(~passive), np.flatnonzero(passive)
    backwards = _permuted(program, np.eye(len(program.cost))[:, np.concatenate([active[::-1], rest])])
    best: FloatArray | None = None
    while True:  # each time that something better is found
        settled = EnumerationOutcome(True, best, max(best_mps + FASTER_MPS, 0.0), 0)
        if is_empty(*polytope(program, _limit(best_mps))):
            return settled
        trees = []
        for each in (reduced(program, passive, _limit(best_mps)), backwards):
            if each is not None:
                tree = _Tree(each.program, len(active), best_mps, deadline)
                if not tree.narrow():
                    return settled._replace(finished=not tree.late)
                tree.estimate(generator)
                trees.append((tree, each.transform, partial(_judged, judge, each.transform)))
        tree, transform, judged = trees[0]
        found = tree.dive(judged, generator)
        if found is None:
            break
        best, best_mps = transform @ found, tree.best_mps
    tree, transform, judged = trees[-1] if trees[-1][0].size * CLEARLY < trees[0][0].size else trees[0]
    outcome = tree.search(judged)
    return outcome._replace(best=best if outcome.best is None else transform @ outcome.best)


def _judged(judge: Judge, transform: FloatArray, point: FloatArray) -> float | None:
    return judge(transform @ point)


def _permuted(program: Program, order: FloatArray) -> Reduced:
    """A program whose variables have another order."""
    rows = program.rows._replace(matrix=sparse.csr_matrix(program.rows.matrix @ order))
    lower, upper, cost = (order.T @ each for each in (program.lower, program.upper, program.cost))
    return Reduced(replace(program, cost=cost, rows=rows, lower=lower, upper=upper), order)


def _limit(best_mps: float) -> float:
    """The largest objective of what is faster; inf where nothing is known."""
    return -(best_mps + FASTER_MPS) if best_mps >= 0 else np.inf


class _Tree:
    """A linear program whose column bounds move along the branches: the first `active` columns in their order."""

    def __init__(self, program: Program, active: int, best_mps: float, deadline: float) -> None:
        self.cost, self.active, self.best_mps, self.deadline, self.nodes = program.cost, active, best_mps, deadline, 0
        self.lower, self.upper, self.size, self.proof_s = program.lower.copy(), program.upper.copy(), np.inf, 0.0
        drift = np.zeros((1, program.rows.drift.shape[1]))
        faster = Rows(sparse.csr_matrix(program.cost[np.newaxis]), np.array([-np.inf]), np.array([np.inf]), drift)
        rows = stack([program.rows, faster])
        self._cut = len(rows.lower) - 1
        self._solver = load(replace(program, cost=np.zeros(len(program.cost)), rows=rows, integer=None))
        self._states = highspy().HighsModelStatus
        self._ask_for(best_mps)

    @property
    def late(self) -> bool:
        """Whether time is up."""
        return time.thread_time() > self.deadline

    def narrow(self) -> bool:
        """Narrow the ranges of all variables until they stay; False where one is empty, or time is up."""
        for _ in range(PASSES):
            before = (self.upper - self.lower).sum()
            for column in range(len(self.cost)):
                low, high = self._range(column)
                if low > high or self.late:
                    return False
                self.lower[column], self.upper[column] = max(low, self.lower[column]), min(high, self.upper[column])
                self._bound(column, self.lower[column], self.upper[column])
            if (self.upper - self.lower).sum() == before:
                break
        return True

    def estimate(self, generator: np.random.Generator) -> None:
        """The nodes to expect, and the time that all of them take, from random descents.

        The mean of the products of the ranges that they meet has no bias, but it is that of the worst descent: the
        median, `size`, tells trees apart, the mean how long to look for something better first.
        """
        sizes, started, before = [], time.thread_time(), self.nodes
        for _ in range(DESCENTS):
            total, weight, depth = 1.0, 1.0, 0
            while depth < self.active and not self.late:
                low, high = self._node(depth)
                if low > high:
                    break
                weight *= high - low + 1
                total += weight
                value = float(generator.integers(int(low), int(high) + 1))
                self._bound(depth, value, value)
                depth += 1
            self._release(range(depth))
            sizes.append(total)
        node_s = (time.thread_time() - started) / max(1, self.nodes - before)
        self.size, self.proof_s = float(np.median(sizes)), float(np.mean(sizes)) * node_s

    def dive(self, judge: Judge, generator: np.random.Generator) -> FloatArray | None:
        """Something better, from descents through the middle of the ranges; None where they find none in time.

        They take no longer than the proof is expected to take, and no more than a share of the time that is left.
        """
        now = time.thread_time()
        stop = now + min(self.proof_s, DIVES * (self.deadline - now))
        while time.thread_time() < stop:
            depth, alive = 0, True
            while alive and depth < self.active:
                low, high = self._node(depth)
                alive = low <= high
                if alive:
                    width = (high - low) / 2
                    value = (low + high) / 2 + generator.normal() * (SPREAD * width + LEAST_SPREAD)
                    value = min(max(float(np.rint(value)), low), high)
                    self._bound(depth, value, value)
                    depth += 1
            point = self._complete() if alive else None
            self._release(range(depth))
            speed_mps = None if point is None else judge(point)
            if speed_mps is not None and speed_mps > self.best_mps:
                self.best_mps = speed_mps
                return point
        return None

    def search(self, judge: Judge) -> EnumerationOutcome:
        """Depth first. Solutions that do not replay are passed over, but no bound below them is claimed."""
        best, bound_mps = None, self.best_mps + FASTER_MPS
        depth, left = 0, [self._values(0)]
        while depth >= 0:
            if self.late:
                return EnumerationOutcome(False, best, np.inf, self.nodes)
            if not left[depth]:
                self._release([depth])
                left.pop()
                depth -= 1
                continue
            value = left[depth].pop()
            self._bound(depth, value, value)
            if depth + 1 < self.active:
                depth += 1
                left.append(self._values(depth))
                continue
            point = self._complete()
            if point is not None:
                speed_mps = judge(point)
                bound_mps = max(bound_mps, -float(self.cost @ point) if speed_mps is None else speed_mps + FASTER_MPS)
                if speed_mps is not None and speed_mps > self.best_mps:
                    best, self.best_mps = point, speed_mps
                    self._ask_for(speed_mps)
        return EnumerationOutcome(True, best, max(bound_mps, 0.0), self.nodes)

    def _complete(self) -> FloatArray | None:
        """The solution (columns,) of the fixed variables, the others as low as they may be; None if there is none."""
        passive, point = range(self.active, len(self.cost)), None
        low, high = self._range(0)  # which is fixed: is everything feasible?
        for column in passive:
            if low <= high:
                low, high = self._range(column)
                self._bound(column, low, low)
        if low <= high and self._range(0)[0] < np.inf:
            point = np.rint(self._solver.getSolution().col_value)
        self._release(passive)
        return point

    def _values(self, column: int) -> list[float]:
        """The whole values of a variable, those in the middle to be taken first, from the end of the list."""
        low, high = self._node(column)
        return sorted(np.arange(low, high + 1).tolist(), key=lambda value: -abs(value - (low + high) / 2))

    def _node(self, column: int) -> tuple[float, float]:
        """See `_range`; counted."""
        self.nodes += 1
        return self._range(column)

    def _range(self, column: int) -> tuple[float, float]:
        """The lowest and the highest whole value of a variable; the first is larger where there is none.

        Where the two programs disagree on whether anything is feasible, nothing is cut off.
        """
        low = self._extreme(column, 1.0, self.lower[column])
        if low == np.inf:
            return 1.0, 0.0
        if low >= self.upper[column]:  # nothing is left to ask
            return low, self.upper[column]
        high = -self._extreme(column, -1.0, -self.upper[column])
        return low, self.upper[column] if high == -np.inf else high

    def _extreme(self, column: int, sign: float, otherwise: float) -> float:
        """The lowest whole value of sign * variable; inf where nothing is feasible."""
        solver = self._solver
        solver.changeColCost(column, sign)
        solver.run()
        state = solver.getModelStatus()
        value = solver.getInfo().objective_function_value
        solver.changeColCost(column, 0.0)
        if state == self._states.kInfeasible:
            return float(np.inf)
        return float(np.ceil(value - ROUNDING)) if state == self._states.kOptimal else float(otherwise)

    def _ask_for(self, best_mps: float) -> None:
        """Ask for solutions that are faster; for all of them where nothing is known."""
        self._solver.changeRowBounds(self._cut, -np.inf, _limit(best_mps))

    def _bound(self, column: int, lower: float, upper: float) -> None:
        self._solver.changeColBounds(int(column), float(lower), float(upper))

    def _release(self, columns: Sequence[int] | IntArray) -> None:
        for column in columns:
            self._bound(column, self.lower[column], self.upper[column])
