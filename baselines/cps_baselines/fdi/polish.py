"""Better attacks near a known one: all injections but those of some steps stay, and HiGHS finds the best others."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cps_baselines.fdi.highs import Limits, Program, solve
from cps_envs.core.types import BoolArray, FloatArray

WIDTHS = (8, 11)  # steps that are free at a time
SEARCH_S = 4.0  # for one choice of steps
GAP = 1e-4


def polish(program: Program, steps: int, variables: FloatArray, time_limit_s: float, seed: int = 0) -> FloatArray:
    """A point (columns,) of a program with step-major columns that is no worse than the feasible `variables`."""
    best, best_objective, deadline = variables, float(program.cost @ variables), time.perf_counter() + time_limit_s
    for free in _windows(steps, np.random.default_rng(seed)):
        left_s = deadline - time.perf_counter()
        if left_s <= 0:
            break
        kept = ~np.repeat(free, len(best) // steps)
        lower, upper = np.where(kept, best, program.lower), np.where(kept, best, program.upper)
        found = solve(replace(program, lower=lower, upper=upper), Limits(min(SEARCH_S, left_s), GAP), best)
        if found.columns is not None and found.objective < best_objective:
            best, best_objective = np.rint(found.columns), found.objective
    return best


def _windows(steps: int, generator: np.random.Generator) -> Iterator[BoolArray]:
    """Marks (steps,) of free steps, without end: two runs of successive steps, then scattered ones."""
    while True:
        for width in WIDTHS:
            for _ in range(2):
                first = generator.integers(min(0, 2 - width), steps - 1)
                yield (np.arange(steps) >= first) & (np.arange(steps) < first + width)
            yield np.isin(np.arange(steps), generator.permutation(steps)[: width + 2])
