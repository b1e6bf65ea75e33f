from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cps_baselines.fdi.grid import GRID_MPS, GridCell, solve_cell
from cps_envs.core.errors import MissingExtraError
from cps_envs.fdi.config import A
from cps_envs.fdi.task import parse_task
from tests.fdi.simulation import play

TABLE_3_1 = replace(A, horizon=14)
TABLE_3_7 = replace(A, horizon=12, num_vehicles=5)


def check(cell: GridCell, horizon: int, num_vehicles: int = 4) -> None:
    """A cell against a simulation of its injections."""
    assert cell.injections is not None
    assert cell.injections.shape == (horizon, cell.task.sensors.count)
    config = replace(A, horizon=horizon, num_vehicles=num_vehicles, attacked=str(cell.task.sensors))
    end = play(config, cell.task.sensors, cell.injections).errors[-1]
    target = cell.task.target - 1
    assert cell.speed_mps == pytest.approx(end[num_vehicles + target])
    distances = [np.hypot(end[target] + 5, end[num_vehicles + target] - speed_mps) for speed_mps in GRID_MPS]
    assert min(distances) == pytest.approx(cell.distance)
    assert cell.distance is not None
    assert cell.distance <= 0.45
    near = {i for i in range(1, num_vehicles + 1) if end[i - 1] <= -4.75} | {cell.task.target}
    assert dict(cell.pairs) == pytest.approx({i: end[num_vehicles + i - 1] for i in near})


@pytest.mark.parametrize("name", ["x1>1", "x2>2", "x3>3", "x4>4", "v4>4"])
@pytest.mark.parametrize("back_end", ["highs", "scip"])
def test_reachable_cells(name: str, back_end: str) -> None:
    if back_end == "scip":
        pytest.importorskip("pyscipopt")
    cell = solve_cell(TABLE_3_1, parse_task(name, 4), back_end, time_limit_s=20)
    assert cell.reachable
    assert cell.back_end == back_end
    assert cell.solves == len(cell.statuses) >= 1
    assert set(cell.statuses) <= {"proved", "infeasible", "time limit"}
    check(cell, 14)


def test_a_cell_of_a_longer_platoon() -> None:
    cell = solve_cell(TABLE_3_7, parse_task("v5>5", 5), time_limit_s=20)
    assert cell.reachable
    check(cell, 12, 5)


def test_the_relaxation_settles_unreachable_cells() -> None:
    cell = solve_cell(TABLE_3_1, parse_task("x4>1", 4))
    assert (cell.reachable, cell.speed_mps, cell.pairs, cell.distance, cell.solves) == (False, None, (), None, 0)


def test_a_stricter_acceptance_reaches_no_more() -> None:
    task = parse_task("x1>1", 4)
    cells = [solve_cell(TABLE_3_1, task, acceptance=acceptance, time_limit_s=20) for acceptance in (0.45, 1e-5)]
    assert cells[0].reachable
    assert not cells[1].reachable
    assert cells[1].distance is not None
    assert cells[1].distance > 1e-5


def test_unknown_back_ends() -> None:
    with pytest.raises(ValueError, match="Did you mean 'highs'"):
        solve_cell(A, parse_task("x1>1", 4), "high")


def test_a_missing_back_end_names_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "docplex", None)
    monkeypatch.setitem(__import__("sys").modules, "docplex.mp.model", None)
    with pytest.raises(MissingExtraError, match="pip install docplex cplex"):
        solve_cell(TABLE_3_1, parse_task("x4>4", 4), "cplex")
