from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_baselines.fdi.continuation import best_from, integer_continuation, legal_continuation
from cps_baselines.fdi.cross import cross, relaxation_mps
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import A, FdiConfig
from cps_envs.fdi.task import Task, parse_task
from tests.fdi.reference import play

SHORT = replace(A, horizon=8)
LEAD = parse_task("x4>4", 4)


def legally_ends(config: FdiConfig, task: Task, error: FloatArray, levels: IntArray, step: int) -> bool:
    """Whether levels lead from a state to the last step, or to a collision at their end, without anything illegal."""
    course = play(config, task.sensors, levels, error)
    spoofed = course.readings[:, :4][:, task.sensors.flags(4)[:4]]
    legal = np.all(np.abs(course.commands) <= 5 + 1e-6) and np.all(spoofed >= -5 - 1e-6)
    collided = course.errors[1:, :4].min(axis=1) <= -5
    over = step + len(levels) == config.horizon or collided[-1]
    return bool(legal and over and not collided[:-1].any())


def test_from_rest_the_plan_is_the_relaxation() -> None:
    for name in ("x4>4", "x1,2>1", "xv3>3"):
        task = parse_task(name, 4)
        plan = best_from(A, task, np.zeros(8), 0)
        longest = best_from(A, task, np.zeros(8), 0, [A.horizon])
        assert plan is not None
        assert longest is not None
        assert plan.speed_mps == pytest.approx(relaxation_mps(A, task), abs=2e-6)
        assert longest.speed_mps == pytest.approx(plan.speed_mps, abs=2e-6)
        course = play(A, task.sensors, plan.levels)  # type: ignore[arg-type]
        assert course.errors[-1, task.target - 1] <= -5 + 2e-6
        assert -course.errors[-1, 4 + task.target - 1] == pytest.approx(plan.speed_mps, abs=1e-6)


def test_along_an_optimal_attack_the_relaxation_stays_above_it_and_never_grows() -> None:
    record = cross(A, LEAD)
    assert record.injections is not None
    assert record.value_mps is not None
    errors = play(A, LEAD.sensors, record.injections).errors
    plans = [best_from(A, LEAD, error, step) for step, error in enumerate(errors[:-1])]
    speeds = [plan.speed_mps for plan in plans if plan is not None]
    assert len(speeds) == 20
    assert all(after <= before + 1e-5 for before, after in pairwise(speeds))
    assert min(speeds) >= record.value_mps - 1e-6
    assert all(legal_continuation(A, LEAD, error, step) for step, error in enumerate(errors[:-1]))


def test_a_plan_does_not_depend_on_what_was_asked_before() -> None:
    error = play(A, LEAD.sensors, np.full((3, 1), -5)).errors[-1]
    first = best_from(A, LEAD, error, 3)
    for step in range(4):
        best_from(A, LEAD, np.zeros(8), step)
    again = best_from(A, LEAD, error, 3)
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.levels, again.levels)


def test_out_of_reach() -> None:
    assert best_from(A, parse_task("x4>1", 4), np.zeros(8), 0) is None
    assert best_from(A, LEAD, np.zeros(8), 20) is None


@given(st.integers(0, 2**32 - 1), st.integers(0, 8), st.sampled_from(["x4>4", "xv2>2", "v1,3>1"]))
@settings(max_examples=60)
def test_whole_continuations_are_legal_and_continuous_ones_exist_with_them(seed: int, step: int, name: str) -> None:
    task = parse_task(name, 4)
    error = np.random.default_rng(seed).normal(scale=1.2, size=8)
    levels = integer_continuation(SHORT, task, error, step)
    possible = legal_continuation(SHORT, task, error, step)
    if levels is None:
        return
    assert possible
    assert levels.shape[1] == task.sensors.count
    assert step == 8 or legally_ends(SHORT, task, error, levels, step)


def test_a_dead_end() -> None:
    """Vehicle 3, which nobody attacks, would have to brake harder than it can."""
    error = np.zeros(8)
    error[4 + 2] = -2.0  # e_v,3: -6 m/s2
    assert not legal_continuation(A, LEAD, error, 5)
    assert integer_continuation(A, LEAD, error, 5) is None
    error[4 + 2] = -1.6
    assert legal_continuation(A, LEAD, error, 5)


def test_a_collision_is_a_legal_end() -> None:
    """Too fast to stop: an episode of one more step goes on, a longer one can only collide."""
    error = np.zeros(8)
    error[3], error[7] = -4.5, -3.0
    levels = integer_continuation(A, parse_task("xv4>4", 4), error, 5)
    assert levels is not None
    assert len(levels) == 1
    assert legally_ends(A, parse_task("xv4>4", 4), error, levels, 5)
