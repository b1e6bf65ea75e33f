"""How an attacker collides as fast as possible from a given state.

With continuous injections a linear program decides for each number of steps; no whole levels are faster.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.highs import Program, Solution, load, run, solve
from cps_baselines.fdi.lifted import STRICT_GAP_M, end_rows, legal_rows, lift, stack
from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task

SAME_MPS = 1e-6  # of two endings that are this alike the longer is taken


class Ending(NamedTuple):
    """`steps` more injections, then the pair collides. Pairs count from 0."""

    steps: int
    pair: int


def best_from(
    config: FdiConfig, task: Task, error: FloatArray, step: int, lengths: Sequence[int] | None = None
) -> FloatArray | None:
    """Continuous levels (k, q) that lead from e(step) = `error` (2n,) to the fastest collision of the target.

    They are in units of the resolution, and the last one leads to the collision. None where no collision is reached.
    The levels depend on the arguments, see `fastest_from`, alone, not on what was asked before.
    """
    best = fastest_from(config, task, error, step, lengths)
    if best is None:
        return None
    _, ending = best
    found = solve(from_state(_loaded(config, task.sensors, ending).program, error))
    return None if found.columns is None else found.columns.reshape(ending.steps, -1)


def fastest_from(
    config: FdiConfig, task: Task, error: FloatArray, step: int, lengths: Sequence[int] | None = None
) -> tuple[float, Ending] | None:
    """Speed (m/s, 0 or more) and ending of the fastest collision of the target, of which `best_from` gives the levels.

    `lengths` are the numbers of injections to consider; all up to the horizon if left out. From rest the longest alone
    will do, since waiting is free there. No whole levels are faster; where no collision is reached, which is None,
    whole levels reach none either.
    """
    target, best_mps, ending = task.target - 1, -np.inf, None
    for steps in sorted(range(1, config.horizon - step + 1) if lengths is None else lengths, reverse=True):
        reached_mps = _closing(config, task, error, Ending(steps, target))
        if reached_mps > best_mps + SAME_MPS:
            best_mps, ending = reached_mps, Ending(steps, target)
    return None if ending is None else (max(0.0, best_mps), ending)


def _closing(config: FdiConfig, task: Task, error: FloatArray, ending: Ending) -> float:
    """-e_v of the target at its collision, m/s; -inf where it is out of reach."""
    found = _loaded(config, task.sensors, ending).solve(error)
    drift = lift(config, task.sensors).drift[ending.steps, config.num_vehicles + task.target - 1]
    return -found.objective - float(drift @ error)


class _Loaded:
    """A linear program in a solver, which begins where its last solution was; rows move with the state."""

    def __init__(self, program: Program) -> None:
        self.program, self._solver, self._lock = program, load(program), threading.Lock()
        self._rows = np.arange(len(program.rows.lower), dtype=np.int32)

    def solve(self, error: FloatArray) -> Solution:
        """Solve from the error (2n,)."""
        rows = from_state(self.program, error).rows
        with self._lock:
            self._solver.changeRowsBounds(len(self._rows), self._rows, rows.lower, rows.upper)
            return run(self._solver)


@lru_cache(maxsize=1024)
def _loaded(config: FdiConfig, sensors: Sensors, ending: Ending) -> _Loaded:
    return _Loaded(program_to(config, sensors, ending))


def program_to(config: FdiConfig, sensors: Sensors, ending: Ending, *, strict: bool = False) -> Program:
    """Legal levels (k q,) from rest to an ending, for the fastest collision of its pair.

    As such the program is a relaxation of the environment: a gap may close to 1e-6 m above a collision at the end,
    touch one before it, and limits have the environment's tolerance. The strict one keeps that far from touching, so
    that rounding changes no step of its solutions.
    """
    rows = legal_rows(config, sensors, ending.steps, strict=strict)
    margin_m = STRICT_GAP_M if strict else -STRICT_GAP_M
    touch_m = -config.desired_gap_m - margin_m
    rows = stack([rows, end_rows(config, sensors, ending.steps, ending.pair, -np.inf, touch_m)])
    levels = np.tile(lift(config, sensors).levels, ending.steps).astype(np.float64)
    cost = lift(config, sensors).errors[ending.steps, config.num_vehicles + ending.pair, : len(levels)]
    return Program(cost, rows, -levels, levels)


def from_state(program: Program, error: FloatArray) -> Program:
    """The program from the state e(0) = error (2n,) instead of rest."""
    offset = program.rows.drift @ error
    rows = program.rows._replace(lower=program.rows.lower - offset, upper=program.rows.upper - offset)
    return replace(program, rows=rows)
