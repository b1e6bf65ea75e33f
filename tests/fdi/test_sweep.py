from __future__ import annotations

import csv
from dataclasses import replace
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from cps_baselines.fdi import sweep as module
from cps_baselines.fdi.cross import cross
from cps_baselines.fdi.sweep import best_start, open_tasks, paper_tasks, sweep
from cps_envs.core.errors import MissingExtraError
from cps_envs.fdi.config import A
from cps_envs.fdi.optima import INFEASIBLE, PROVED, TIME_LIMIT, Record
from cps_envs.fdi.task import Task, make_task, parse_task

SHORT = replace(A, horizon=12)
TASKS = [parse_task(text, 4) for text in ("x4>4", "v4>4", "x4>1", "xv4>4")]


@pytest.mark.parametrize(("num_vehicles", "tables"), [(4, range(1, 7)), (5, [7])])
def test_the_tasks_are_the_cells_of_the_tables(num_vehicles: int, tables: Any) -> None:
    cells: list[Task] = []
    for table in tables:
        text = (files("cps_baselines.paper") / f"table_3_{table}.csv").read_text(encoding="utf-8")
        rows = csv.DictReader(text.splitlines())
        cells += [make_task(row["attacked"], int(row["target"]), num_vehicles) for row in rows]
    known = paper_tasks(num_vehicles)
    assert len(set(known)) == len(known) == {4: 120, 5: 225}[num_vehicles]
    if num_vehicles == 4:
        assert sorted(map(str, cells)) == sorted(map(str, known))
    else:
        assert set(cells) < set(known)


@pytest.mark.parametrize(("jobs", "backend"), [(1, "loky"), (2, "threading"), (2, "loky")])
def test_every_task_gets_its_record(jobs: int, backend: str) -> None:
    records = {record.task: record for record in sweep(SHORT, TASKS, {}, jobs=jobs, backend=backend)}
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


def test_unknown_and_missing_backends(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="no_such_backend"):
        list(sweep(SHORT, TASKS, {}, jobs=2, backend="no_such_backend"))
    for backend, package in (("dask", "distributed"), ("ray", "ray")):
        monkeypatch.setitem(__import__("sys").modules, package, None)
        with pytest.raises(MissingExtraError, match=f"pip install {package}"):
            list(sweep(SHORT, TASKS, {}, backend=backend))
