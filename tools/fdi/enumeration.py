"""Proofs of optimality by exhaustive search: whole numbers one by one, each within what linear programs leave to it.

A branch fixes the variables of a program in a fixed order. The range of the next one, under what is fixed and a speed
that has to be beaten, is that of two linear programs. The order decides how large the tree is, so that it is measured
first: random descents estimate its size (Knuth 1975, Estimating the efficiency of backtrack programs). The last
injections first is often a thousand times better than the first injections first: the end allows few of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from cps_baselines.fdi.cross import checked, crossing_program, replayed, status_of
from cps_baselines.fdi.highs import Program, highspy, load
from cps_baselines.fdi.lifted import NEGLIGIBLE, Rows, columns_of, lift, stack
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.optima import INFEASIBLE, Record

FASTER_MPS = 1e-5  # by which an attack has to beat the best one, and which a proof leaves open
ROUNDING = 1e-6  # of the ends of ranges, which are whole
DESCENTS = 30  # for an estimate
PASSES = 3  # over all variables, to narrow their ranges

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
    deadline, seed = time.thread_time() + time_limit_s, np.random.default_rng(0)
    tree = _Tree(program, best_mps, deadline)
    if not tree.narrow():
        return EnumerationOutcome(not tree.late, None, max(best_mps + FASTER_MPS, 0.0), tree.nodes)
    active = np.flatnonzero(~passive)
    backwards = active[::-1]
    narrowest = active[np.argsort((tree.upper - tree.lower)[active], kind="stable")]
    orders = [np.concatenate([order, np.flatnonzero(passive)]) for order in (backwards, narrowest)]
    sizes = [tree.estimate(order, len(active), seed) for order in orders]
    return tree.search(orders[int(np.argmin(sizes))], len(active), judge)


def exhausted(config: FdiConfig, record: Record, time_limit_s: float) -> Record:
    """A record after an exhaustive search, of so many CPU seconds, for something better."""
    task, program, columns = record.task, crossing_program(config, record.task), columns_of(config, record.task.sensors)
    moving = np.abs(lift(config, task.sensors).errors[1:].reshape(-1, len(program.cost)) @ columns.transform)
    passive = moving.max(axis=0) < NEGLIGIBLE
    best_mps = -1.0 if record.value_mps is None else record.value_mps
    found = exhaust(program, passive, best_mps, lambda point: replayed(config, task, [point])[0], time_limit_s)
    if found.best is not None:
        value_mps, injections = replayed(config, task, [found.best])
        record = replace(record, value_mps=value_mps, injections=injections)
    if not found.finished:
        return record
    if record.value_mps is None and found.bound_mps <= FASTER_MPS:
        return replace(record, bound_mps=0.0, status=INFEASIBLE)
    bound_mps = checked(min(record.bound_mps, found.bound_mps), record.value_mps, task)
    record = replace(record, bound_mps=bound_mps)
    return replace(record, status=status_of(record))


class _Tree:
    """A linear program whose column bounds move along the branches."""

    def __init__(self, program: Program, best_mps: float, deadline: float) -> None:
        self.cost, self.best_mps, self.deadline, self.nodes = program.cost, best_mps, deadline, 0
        self.lower, self.upper = program.lower.copy(), program.upper.copy()
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

    def estimate(self, order: IntArray, active: int, generator: np.random.Generator) -> float:
        """The expected number of nodes: of random descents, the mean of the products of the ranges."""
        total = 0.0
        for _ in range(DESCENTS):
            weight, depth = 1.0, 0
            while depth < active and not self.late:
                low, high = self._range(order[depth])
                if low > high:
                    break
                weight *= high - low + 1
                total += weight
                value = float(generator.integers(int(low), int(high) + 1))
                self._bound(order[depth], value, value)
                depth += 1
            self._release(order[:depth])
        return total / DESCENTS

    def search(self, order: IntArray, active: int, judge: Judge) -> EnumerationOutcome:
        """Depth first. Solutions that do not replay are passed over, but no bound below them is claimed."""
        best, bound_mps = None, self.best_mps + FASTER_MPS
        depth, left = 0, [self._values(order[0])]
        while depth >= 0:
            if self.late:
                return EnumerationOutcome(False, best, np.inf, self.nodes)
            column = order[depth]
            if not left[depth]:
                self._release(order[depth : depth + 1])
                left.pop()
                depth -= 1
                continue
            value = left[depth].pop()
            self._bound(column, value, value)
            if depth + 1 < active:
                depth += 1
                left.append(self._values(order[depth]))
                continue
            point = self._complete(order, active)
            if point is not None:
                speed_mps = judge(point)
                bound_mps = max(bound_mps, -float(self.cost @ point) if speed_mps is None else speed_mps + FASTER_MPS)
                if speed_mps is not None and speed_mps > self.best_mps:
                    best, self.best_mps = point, speed_mps
                    self._ask_for(speed_mps)
        return EnumerationOutcome(True, best, max(bound_mps, 0.0), self.nodes)

    def _complete(self, order: IntArray, active: int) -> FloatArray | None:
        """The solution (columns,) of the fixed variables, the others as low as they may be; None if there is none."""
        passive, point = order[active:], None
        low, high = self._range(order[0])  # which is fixed: is everything feasible?
        for column in passive:
            if low <= high:
                low, high = self._range(column)
                self._bound(column, low, low)
        if low <= high and self._range(order[0])[0] < np.inf:
            point = np.rint(self._solver.getSolution().col_value)
        self._release(passive)
        return point

    def _values(self, column: int) -> list[float]:
        """The whole values of a variable, those in the middle to be taken first, from the end of the list."""
        low, high = self._range(column)
        self.nodes += 1
        return sorted(np.arange(low, high + 1).tolist(), key=lambda value: -abs(value - (low + high) / 2))

    def _range(self, column: int) -> tuple[float, float]:
        """The lowest and the highest whole value of a variable; the first is larger where there is none.

        Where the two programs disagree on whether anything is feasible, nothing is cut off.
        """
        low = self._extreme(column, 1.0, self.lower[column])
        if low == np.inf:
            return 1.0, 0.0
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
        limit = -(best_mps + FASTER_MPS) if best_mps >= 0 else np.inf
        self._solver.changeRowBounds(self._cut, -np.inf, limit)

    def _bound(self, column: int, lower: float, upper: float) -> None:
        self._solver.changeColBounds(int(column), float(lower), float(upper))

    def _release(self, columns: Sequence[int] | IntArray) -> None:
        for column in columns:
            self._bound(column, self.lower[column], self.upper[column])
