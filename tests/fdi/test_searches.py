"""Searches for optima against brute force, the integer programs, replays and what is proved."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from cps_baselines.fdi import sweep as module
from cps_baselines.fdi.annealing import anneal
from cps_baselines.fdi.continuation import best_from, integer_continuation, legal_continuation
from cps_baselines.fdi.cross import Extra, cross, relaxation_mps
from cps_baselines.fdi.enumeration import FASTER_MPS, exhaust
from cps_baselines.fdi.highs import Program
from cps_baselines.fdi.lifted import Rows
from cps_baselines.fdi.replay import NoReplayError, replay
from cps_baselines.fdi.sweep import best_start, open_tasks, paper_tasks, sweep
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import CLIP, A, FdiConfig
from cps_envs.fdi.optima import INFEASIBLE, PROVED, TIME_LIMIT, Record, known
from cps_envs.fdi.task import Task, make_task, parse_task
from tests.fdi.reference import play

whole = st.integers(-4, 4)
PLANS = 20_000
SHORT = replace(A, horizon=12)
TASKS = [parse_task(text, 4) for text in ("x4>4", "v4>4", "x4>1", "xv4>4")]
BRIEF = replace(A, horizon=8)
LEAD = parse_task("x4>4", 4)


def judge(program: Program) -> Callable[..., Any]:
    return lambda point: -float(program.cost @ point)


@given(
    st.lists(whole, min_size=3, max_size=3), st.lists(st.lists(whole, min_size=3, max_size=3), min_size=2, max_size=4)
)
@settings(max_examples=40, deadline=None)
def test_small_programs_by_brute_force(cost: list[int], matrix: list[list[int]]) -> None:
    limits = 2.0 + np.arange(len(matrix))
    rows = Rows(sparse.csr_matrix(np.array(matrix, float)), -limits, limits, np.zeros((len(matrix), 2)))
    program = Program(np.array(cost, float), rows, np.full(3, -3.0), np.full(3, 3.0), np.ones(3, np.bool_))
    points = np.array(list(product(range(-3, 4), repeat=3)))
    legal = points[(np.abs(points @ np.array(matrix).T) <= limits).all(axis=1)]
    best = float((-legal @ np.array(cost)).max())  # at least 0: all variables 0 are legal
    found = exhaust(program, np.zeros(3, np.bool_), -1.0, judge(program), 60.0)
    assert found.finished
    assert found.best is not None
    assert -float(program.cost @ found.best) == pytest.approx(best)
    assert best <= found.bound_mps <= best + 2 * FASTER_MPS
    none = exhaust(program, np.zeros(3, np.bool_), best, judge(program), 60.0)
    assert (none.finished, none.best) == (True, None)


@pytest.mark.parametrize("name", ["x1>1", "v2>2", "v3>3", "v1>2"])
def test_it_proves_what_the_integer_program_proved(name: str) -> None:
    task = parse_task(name, 4)
    expected = known(A)[task]
    record = cross(A, task, 0.0, start=expected.injections, extra=Extra(exhaustive_s=60.0))
    assert record.status == expected.status
    assert record.status in (PROVED, INFEASIBLE)
    assert record.value_mps == pytest.approx(expected.value_mps, abs=2e-6)
    assert record.bound_mps == pytest.approx(expected.bound_mps, abs=1e-4)


def test_without_time_nothing_is_claimed() -> None:
    task = parse_task("xv1,2>4", 4)
    record = cross(A, task, 0.0, start=known(A)[task].injections, extra=Extra(exhaustive_s=0.01))
    assert not record.closed
    assert record.bound_mps == record.lp_mps


@pytest.mark.parametrize(
    ("config", "name"), [(A, "v1,3>1"), (A, "xv2,4>3"), (CLIP, "x1,3>2"), (replace(A, num_vehicles=5), "v4>4")]
)
def test_plans_stay_legal_and_are_no_slower(config: FdiConfig, name: str) -> None:
    task = parse_task(name, config.num_vehicles)
    found = anneal(config, task, None, PLANS)
    if found is not None:
        assert found.shape == (config.horizon, task.sensors.count)
        speed_mps = replay(config, task, found)  # raises where it is not legal
        again = anneal(config, task, found, PLANS, seed=1)
        assert again is not None
        assert replay(config, task, again) >= speed_mps
        if task in known(config):
            assert speed_mps <= known(config)[task].bound_mps + 1e-6


def test_the_same_seed_finds_the_same() -> None:
    task = parse_task("x4>4", 4)
    first, second = (anneal(A, task, known(A)[task].injections, 2000, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_spoilt_optimum_is_mended() -> None:
    task = parse_task("v4>4", 4)
    optimum = known(A)[task]
    assert optimum.injections is not None
    spoilt = optimum.injections.copy()
    spoilt[1:3] += 2
    with pytest.raises(NoReplayError):
        replay(A, task, spoilt)
    found = anneal(A, task, spoilt, PLANS)
    assert found is not None
    assert replay(A, task, found) > 0.9 * (optimum.value_mps or 0.0)


def test_nothing_is_found_where_nothing_is_possible() -> None:
    assert anneal(A, parse_task("x4>1", 4), None, 1000) is None


@pytest.mark.parametrize(("num_vehicles", "tables"), [(4, range(1, 7)), (5, [7])])
def test_the_tasks_are_the_cells_of_the_tables(num_vehicles: int, tables: Any) -> None:
    cells: list[Task] = []
    for table in tables:
        text = (files("cps_paper.printed") / f"table_3_{table}.csv").read_text(encoding="utf-8")
        rows = csv.DictReader(text.splitlines())
        cells += [make_task(row["attacked"], int(row["target"]), num_vehicles) for row in rows]
    known = paper_tasks(num_vehicles)
    assert len(set(known)) == len(known) == {4: 120, 5: 225}[num_vehicles]
    if num_vehicles == 4:
        assert sorted(map(str, cells)) == sorted(map(str, known))
    else:
        assert set(cells) < set(known)


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_task_gets_its_record(jobs: int) -> None:
    records = {record.task: record for record in sweep(SHORT, TASKS, {}, jobs=jobs)}
    assert set(records) == set(TASKS)
    for task, record in records.items():
        alone = cross(SHORT, task)
        assert (record.status, record.lp_mps) == (alone.status, alone.lp_mps)
        assert record.value_mps == pytest.approx(alone.value_mps, abs=2e-4)


def test_what_is_left_to_do() -> None:
    proved, infeasible, late, new = TASKS
    known = {
        proved: Record(proved, 5.0, 4.0, 4.0, PROVED, 1.0),
        infeasible: Record(infeasible, None, None, 0.0, INFEASIBLE, 1.0),
        late: Record(late, 5.0, 4.0, 4.5, TIME_LIMIT, 1.0),
    }
    assert open_tasks(TASKS, known, improve=False) == [new]
    assert open_tasks([new, *TASKS[:3]], known, improve=True) == [late, new]  # fewer sensors first


def test_searches_go_on_from_what_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []

    def search(config: Any, task: Task, time_limit_s: float, gap: float, start: Any, extra: Any) -> Record:
        given.append(start)
        return Record(task, 5.0, 4.2, 4.6, TIME_LIMIT, 2.0)

    monkeypatch.setattr(module, "cross", search)
    plan = np.arange(12).reshape(12, 1)
    known = {TASKS[0]: Record(TASKS[0], 5.0, 4.3, 4.7, TIME_LIMIT, 1.0, plan)}
    records = list(sweep(SHORT, [TASKS[0], TASKS[3]], known))
    np.testing.assert_array_equal(given[0], plan)
    np.testing.assert_array_equal(given[1], np.hstack([plan, 0 * plan]))
    assert records[0] == Record(TASKS[0], 5.0, 4.3, 4.6, TIME_LIMIT, 3.0)
    assert records[1].value_mps == 4.2


def test_the_fastest_part_is_the_start() -> None:
    task = parse_task("x1,3+v3>2", 4)
    plan = np.arange(1, 13).reshape(12, 1)
    parts = {
        "x3>2": Record(parse_task("x3>2", 4), 5.0, 2.0, 2.0, PROVED, 0.0, plan),
        "v3>2": Record(parse_task("v3>2", 4), 5.0, 3.0, 3.0, PROVED, 0.0, 2 * plan),
        "v2>2": Record(parse_task("v2>2", 4), 5.0, 9.0, 9.0, PROVED, 0.0, plan),  # not a part
        "x1>1": Record(parse_task("x1>1", 4), 5.0, 9.0, 9.0, PROVED, 0.0, plan),  # another target
    }
    start = best_start(task, parts.values())
    np.testing.assert_array_equal(start, np.hstack([0 * plan, 0 * plan, 2 * plan]))
    assert best_start(task, [parts["v2>2"], parts["x1>1"]]) is None


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
    levels = integer_continuation(BRIEF, task, error, step)
    possible = legal_continuation(BRIEF, task, error, step)
    if levels is None:
        return
    assert possible
    assert levels.shape[1] == task.sensors.count
    assert step == 8 or legally_ends(BRIEF, task, error, levels, step)


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
