"""What an attacker can still do from a given state: go on legally, or collide as fast as possible.

An episode goes on legally when it reaches the last step, or a collision of any pair before it, without an illegal
injection. With continuous injections a linear program decides: infeasible is a certain dead end, feasible is no
guarantee with whole levels. A mixed-integer program finds the levels themselves.

Calming down comes first: injections just large enough that no vehicle exceeds its limits. Where that leads legally to
the end of the episode, or to a collision, continuous injections can go on legally, and no linear program has to find
it out. Where it does not, nothing is known.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.action_form import Form, new_slots, open_slots, read, say
from cps_baselines.fdi.highs import Limits, Program, Solution, load, run, solve
from cps_baselines.fdi.injection import View, look
from cps_baselines.fdi.lifted import STRICT_GAP_M, end_rows, legal_rows, lift, stack
from cps_envs.core.compute.kernels import borrowed, clip, copy, fill, inlined, kernel, lend, unpack, view
from cps_envs.core.types import BoolArray, FloatArray, IntArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.controller import feedback
from cps_envs.fdi.legality import place, resolution
from cps_envs.fdi.readings import inject
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.state import Constants, Scratch, add_product, new_scratch
from cps_envs.fdi.task import Task

SAME_MPS = 1e-6  # of two endings that are this alike the longer is taken


class Ending(NamedTuple):
    """`steps` more injections; then the pair collides, or anything may happen where it is None. Pairs count from 0."""

    steps: int
    pair: int | None = None


def legal_continuation(config: FdiConfig, task: Task, error: FloatArray, step: int) -> bool:
    """Whether continuous injections can go on legally from e(step) = `error` (2n,); False is a certain dead end."""
    return step >= config.horizon or next(_reachable(config, task.sensors, error, step), None) is not None


def integer_continuation(
    config: FdiConfig, task: Task, error: FloatArray, step: int, time_limit_s: float = 1.0
) -> IntArray | None:
    """Levels (k, q) that go on legally from e(step) = `error` (2n,) to the last step or to a collision of any pair.

    None where there are none, or where none were found in `time_limit_s` for each of the endings.
    """
    if step >= config.horizon:
        return np.zeros((0, task.sensors.count), np.int64)
    for ending in _reachable(config, task.sensors, error, step):
        program = program_to(config, task.sensors, ending, strict=True)
        whole = np.ones(len(program.cost), np.bool_)
        found = solve(replace(from_state(program, error), integer=whole), Limits(time_limit_s))
        if found.columns is not None:
            levels: IntArray = np.rint(found.columns).astype(np.int64).reshape(ending.steps, -1)
            return levels
    return None


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
    found = solve(from_state(_loaded(config, task.sensors, ending, fastest=True).program, error))
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
    found = _loaded(config, task.sensors, ending, fastest=True).solve(error)
    drift = lift(config, task.sensors).drift[ending.steps, config.num_vehicles + task.target - 1]
    return -found.objective - float(drift @ error)


def _reachable(config: FdiConfig, sensors: Sensors, error: FloatArray, step: int) -> Iterator[Ending]:
    """Legal endings of an episode with continuous injections: the last step first, then collisions, soonest first."""
    remaining = config.horizon - step
    if _possible(config, sensors, error, Ending(remaining)):
        yield Ending(remaining)
    for steps in range(1, remaining):
        if not _possible(config, sensors, error, Ending(steps)):
            return  # nor is anything longer
        for pair in range(config.num_vehicles):
            if _possible(config, sensors, error, Ending(steps, pair)):
                yield Ending(steps, pair)


def _possible(config: FdiConfig, sensors: Sensors, error: FloatArray, ending: Ending) -> bool:
    return _loaded(config, sensors, ending, fastest=False).solve(error).columns is not None


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
def _loaded(config: FdiConfig, sensors: Sensors, ending: Ending, *, fastest: bool) -> _Loaded:
    return _Loaded(program_to(config, sensors, ending, fastest=fastest))


def program_to(
    config: FdiConfig, sensors: Sensors, ending: Ending, *, strict: bool = False, fastest: bool = False
) -> Program:
    """Legal levels (k q,) from rest to an ending, without cost, or for the `fastest` collision of its pair.

    As such the program is a relaxation of the environment: a gap may close to 1e-6 m above a collision at the end,
    touch one before it, and limits have the environment's tolerance. The strict one keeps that far from touching, so
    that rounding changes no step of its solutions.
    """
    rows = legal_rows(config, sensors, ending.steps, strict=strict)
    if ending.pair is not None:
        margin_m = STRICT_GAP_M if strict else -STRICT_GAP_M
        touch_m = -config.desired_gap_m - margin_m
        rows = stack([rows, end_rows(config, sensors, ending.steps, ending.pair, -np.inf, touch_m)])
    levels = np.tile(lift(config, sensors).levels, ending.steps).astype(np.float64)
    cost = np.zeros(len(levels))
    if fastest and ending.pair is not None:
        cost = lift(config, sensors).errors[ending.steps, config.num_vehicles + ending.pair, : len(levels)]
    return Program(cost, rows, -levels, levels)


def from_state(program: Program, error: FloatArray) -> Program:
    """The program from the state e(0) = error (2n,) instead of rest."""
    offset = program.rows.drift @ error
    rows = program.rows._replace(lower=program.rows.lower - offset, upper=program.rows.upper - offset)
    return replace(program, rows=rows)


SEEN = 1e-4  # m and m/s; how far a float32 observation may be off the state that the model gives


@kernel
def screen(
    form: Form,
    observation: Observation,
    expected: FloatArray,
    actions: IntArray,
    shows: bool,
    views: View,
    levels: IntArray,
    passed: BoolArray,
    legal: IntArray,
) -> None:
    """What a shield does about the actions (B, S) before it looks at single episodes.

    Args:
        form: of the actions.
        observation: (B, size).
        expected: (B, 2n) the errors by the model, which count where the observations bear them out.
        actions: (B, S) that are asked for.
        shows: let episodes pass of which it can be shown here that they can go on legally.
        views: is filled, with the errors that count.
        levels: (B, S) is filled with what is asked for, or what is injected where it passes.
        passed: (B,) is filled with the episodes that pass.
        legal: (B, S) is filled with the actions where they pass: the nearest legal ones.
    """
    c, n = unpack(Constants, form.constants, 0), expected.shape[1] // 2
    new, scratch, unmasked = new_slots(form, n), new_scratch(n, c.readings, actions.shape[1]), np.empty(0, np.bool_)
    error, nearest = np.empty(2 * n), np.empty(actions.shape[1], np.int64)
    for b in range(passed.size):
        episode, own, s, mask = view(views, b), borrowed(levels)[b], lend(scratch), borrowed(unmasked)
        look(form, c, borrowed(observation)[b], episode)
        correct(episode.error, borrowed(expected)[b])
        slots = open_slots(form, episode.attacked, new)
        read(form, c, episode.error, episode.attacked, slots, mask, borrowed(actions)[b], own)
        passed[b] = False
        if shows:
            say(form, c, episode.error, slots, mask, own, True, borrowed(legal)[b], borrowed(nearest))
            copy(episode.error, borrowed(error))
            inject(s.offset, c, slots.sensors, borrowed(nearest))
            place(slots.sensors, s.slot)
            move(form, borrowed(error), s)
            passed[b] = goes_on(form, c, borrowed(error), episode.step[0] + 1, s)
        if passed[b]:
            say(form, c, episode.error, slots, mask, borrowed(nearest), True, borrowed(legal)[b], own)


@inlined
def correct(seen: FloatArray, expected: FloatArray) -> None:
    """Replace an error (2n,) that was observed by the expected one, if it is near enough to that."""
    near = True
    for j in range(seen.size):
        near &= abs(seen[j] - expected[j]) < SEEN
    if near:
        copy(expected, seen)


@inlined
def goes_on(form: Form, c: Constants, error: FloatArray, step: int, s: Scratch) -> bool:
    """Whether the episode with the error (2n,) at a step can go on legally, as far as this shows."""
    for _ in range(step, c.horizon):
        if has_collided(error, c):
            return True
        if not calm(error, c, s):
            return False
        move(form, error, s)
    return True


@inlined
def calm(error: FloatArray, c: Constants, s: Scratch) -> bool:
    """Fill the injections `s.offset` (2n,) that bring all commands within their limits; False where there are none."""
    n = error.size // 2
    fill(s.offset, 0.0)
    for i in range(n):
        own = feedback(error, c, i)
        missing = clip(own, c.min_acceleration_mps2, c.max_acceleration_mps2) - own if c.limit_commands else 0.0
        if s.slot[i] >= 0 and c.limit_readings and error[i] < -c.desired_gap_m:
            return False
        if missing == 0:
            continue
        rate = missing / c.derivative_gain if c.derivative_gain > 0 else np.inf
        if s.slot[n + i] >= 0 and abs(rate) <= c.rate_levels * resolution(c, n + i, n):
            s.offset[n + i] = rate
            continue
        gap = missing / c.proportional_gain if c.proportional_gain > 0 else np.inf
        if s.slot[i] < 0 or abs(gap) > c.range_levels * resolution(c, i, n):
            return False
        if c.limit_readings and error[i] + gap < -c.desired_gap_m:
            return False
        s.offset[i] = gap
    return True


@inlined
def has_collided(error: FloatArray, c: Constants) -> bool:
    """Whether a gap has closed."""
    least = np.inf
    for i in range(error.size // 2):
        least = min(least, error[i])
    return least <= -c.desired_gap_m


@inlined
def move(form: Form, error: FloatArray, s: Scratch) -> None:
    """One step of the error (2n,) under the injections `s.offset`, (3.16)."""
    copy(error, s.error)
    fill(error, 0.0)
    add_product(form.matrices.step, 0, s.error, error)
    add_product(form.matrices.step, error.size, s.offset, error)
