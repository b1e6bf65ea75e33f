"""Sweeps over many tasks, and plans that continue from a state, against integer programs and replays."""

from __future__ import annotations

import csv
from dataclasses import replace
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from cps_agents.workers import Workers
from cps_baselines.fdi.continuation import best_from, fastest_from
from cps_baselines.fdi.cross import cross, relaxation_mps
from cps_baselines.fdi.sweep import best_start, open_tasks, paper_tasks, sweep
from cps_envs.fdi.config import A
from cps_envs.fdi.optima import INFEASIBLE, PROVED, TIME_LIMIT, Record
from cps_envs.fdi.task import Task, make_task, parse_task
from tests.fdi.reference import play

SHORT = replace(A, horizon=12)
TASKS = [parse_task(text, 4) for text in ("x4>4", "v4>4", "x4>1", "xv4>4")]
LEAD = parse_task("x4>4", 4)


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


@cache
def crossed(task: Task) -> Record:
    return cross(SHORT, task)


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_task_gets_its_record(jobs: int) -> None:
    with Workers(jobs) as pool:
        records = {record.task: record for record in sweep(SHORT, TASKS, {}, run=pool.run)}
    assert set(records) == set(TASKS)
    for task, record in records.items():
        alone = crossed(task)
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

    def crossed(config: Any, task: Task, time_limit_s: float, gap: float, start: Any) -> Record:
        given.append(start)
        return Record(task, 5.0, 4.2, 4.6, TIME_LIMIT, 2.0)

    monkeypatch.setattr("cps_baselines.fdi.sweep.cross", crossed)
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


def test_from_rest_the_plan_is_the_relaxation() -> None:
    for name in ("x4>4", "x1,2>1", "xv3>3"):
        task = parse_task(name, 4)
        plan = best_from(A, task, np.zeros(8), 0)
        fastest, longest = (fastest_from(A, task, np.zeros(8), 0, lengths) for lengths in (None, [A.horizon]))
        assert plan is not None
        assert fastest is not None
        assert longest is not None
        assert fastest[0] == pytest.approx(relaxation_mps(A, task), abs=2e-6)
        assert longest[0] == pytest.approx(fastest[0], abs=2e-6)
        course = play(A, task.sensors, plan)  # type: ignore[arg-type]
        assert course.errors[-1, task.target - 1] <= -5 + 2e-6
        assert -course.errors[-1, 4 + task.target - 1] == pytest.approx(fastest[0], abs=1e-6)


def test_along_an_optimal_attack_the_relaxation_stays_above_it_and_never_grows() -> None:
    record = cross(A, LEAD)
    assert record.injections is not None
    assert record.value_mps is not None
    errors = play(A, LEAD.sensors, record.injections).errors
    plans = [fastest_from(A, LEAD, error, step) for step, error in enumerate(errors[:-1])]
    speeds = [plan[0] for plan in plans if plan is not None]
    assert len(speeds) == 20
    assert all(after <= before + 1e-5 for before, after in pairwise(speeds))
    assert min(speeds) >= record.value_mps - 1e-6


def test_a_plan_does_not_depend_on_what_was_asked_before() -> None:
    error = play(A, LEAD.sensors, np.full((3, 1), -5)).errors[-1]
    first = best_from(A, LEAD, error, 3)
    for step in range(4):
        best_from(A, LEAD, np.zeros(8), step)
    again = best_from(A, LEAD, error, 3)
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first, again)


def test_out_of_reach() -> None:
    assert best_from(A, parse_task("x4>1", 4), np.zeros(8), 0) is None
    assert best_from(A, LEAD, np.zeros(8), 20) is None
