"""Searches for better attacks and for proofs against brute force, integer programs, replays and what is proved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from cps_baselines.fdi.highs import Program
from cps_baselines.fdi.lifted import Rows
from cps_baselines.fdi.replay import NoReplayError, replay
from cps_envs.fdi.config import CLIP, A, FdiConfig
from cps_envs.fdi.optima import INFEASIBLE, PROVED, from_text, known
from cps_envs.fdi.task import parse_task
from tests.agents.command_line import succeeded
from tools.command import program as as_program
from tools.fdi.annealing import anneal
from tools.fdi.certify import certify
from tools.fdi.enumeration import FASTER_MPS, exhaust
from tools.fdi.search import search

whole = st.integers(-4, 4)
PLANS = 20_000


def judge(program: Program) -> Callable[..., Any]:
    return lambda point: -float(program.cost @ point)


@given(
    st.lists(whole, min_size=3, max_size=3), st.lists(st.lists(whole, min_size=3, max_size=3), min_size=2, max_size=4)
)
@settings(max_examples=15, deadline=None)
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
    record = search(A, task, 0.0, 0.0, expected.injections, exhaustive_s=60.0)
    assert record.status == expected.status
    assert record.status in (PROVED, INFEASIBLE)
    assert record.value_mps == pytest.approx(expected.value_mps, abs=2e-6)
    assert record.bound_mps == pytest.approx(expected.bound_mps, abs=1e-4)


def test_without_time_nothing_is_claimed() -> None:
    task = parse_task("xv1,2>4", 4)
    record = search(A, task, 0.0, 0.0, known(A)[task].injections, exhaustive_s=0.01)
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


def test_what_is_out_of_reach_is_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tools.fdi.search.anneal", None)
    record = search(A, parse_task("x4>1", 4), 0.0, 0.0, None, plans=PLANS, exhaustive_s=60.0)
    assert record.status == INFEASIBLE


def test_a_file_is_improved_and_gone_on_with(tmp_path: Path) -> None:
    path, short = tmp_path / "optima.json", ("--set", "horizon=12", "--task", "xv4>4", "--jobs", "1")
    task = parse_task("xv4>4", 4)

    def improved(*limits: str) -> Any:
        succeeded(str(path), *short, *limits, program=as_program(certify))
        return from_text(path.read_text())[1][task]

    found = improved("--time-limit", "0", "--anneal", "1000", "--exhaust", "0")
    assert not found.closed
    assert improved("--anneal", "0", "--exhaust", "0").status == PROVED
    assert improved("--anneal", "0", "--exhaust", "0").value_mps >= found.value_mps
