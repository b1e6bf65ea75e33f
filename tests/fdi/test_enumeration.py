"""Proofs by exhaustive search against brute force and what integer programs proved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from cps_baselines.fdi.cross import cross, exhausted
from cps_baselines.fdi.enumeration import FASTER_MPS, exhaust
from cps_baselines.fdi.highs import Program
from cps_baselines.fdi.lattice import reduce_basis
from cps_baselines.fdi.lifted import Rows
from cps_envs.fdi.config import A
from cps_envs.fdi.optima import INFEASIBLE, PROVED, known
from cps_envs.fdi.task import parse_task
from tests.turns import in_turn

whole = st.integers(-4, 4)


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


@pytest.mark.parametrize("name", in_turn(["v1>2", "x1>1", "v2>2", "v3>3"], 4))
def test_it_proves_what_the_integer_program_proved(name: str) -> None:
    task = parse_task(name, 4)
    expected = known(A)[task]
    record = exhausted(A, cross(A, task, 0.0, 0.0, expected.injections), 60.0)
    assert record.status == expected.status
    assert record.status in (PROVED, INFEASIBLE)
    assert record.value_mps == pytest.approx(expected.value_mps, abs=2e-6)
    assert record.bound_mps == pytest.approx(expected.bound_mps, abs=1e-4)


def test_a_task_without_an_attack_is_proved_out_of_reach() -> None:
    """Continuous injections reach it; the reduced basis shows at once that whole ones do not."""
    five = replace(A, num_vehicles=5)
    record = exhausted(five, cross(five, parse_task("v1,2>3", 5), 0.0), 60.0)
    assert record.lp_mps is not None
    assert (record.status, record.bound_mps) == (INFEASIBLE, 0.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_reduced_basis_is_whole_and_short(seed: int) -> None:
    generator = np.random.default_rng(seed)
    skew = np.eye(8) + np.triu(generator.integers(-9, 10, (8, 8)), 1)
    gram = skew @ np.diag(generator.uniform(0.5, 2.0, 8)) @ skew.T
    basis = reduce_basis(gram)
    np.testing.assert_array_equal(basis, np.rint(basis))
    assert abs(np.linalg.det(basis)) == pytest.approx(1.0)
    assert np.diag(basis @ gram @ basis.T).max() < 10.0


def test_without_time_nothing_is_claimed() -> None:
    task = parse_task("xv1,2>4", 4)
    record = exhausted(A, cross(A, task, 0.0, 0.0, known(A)[task].injections), 0.01)
    assert not record.closed
    assert record.bound_mps == record.lp_mps
