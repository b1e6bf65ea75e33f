"""The integer programs: lifted constraints against the platoon, and the cells that they solve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_baselines.fdi.lifted import columns_of, end_rows, joint_ratio, legal_rows, lift, violation
from cps_envs.fdi.config import A, FdiConfig
from cps_envs.fdi.sensors import parse_sensors
from cps_envs.fdi.task import Task, parse_task
from cps_paper.fdi.grid import GRID_MPS, collisions, reach
from cps_paper.fdi.interpretations import B
from tests.fdi.reference import play, tasks

SHORT = [
    replace(A, horizon=10),
    replace(B, horizon=10),
    replace(A, horizon=12, dt_s=0.1, discretisation="euler"),
    replace(A, horizon=12, dt_s=0.1, discretisation="zohu"),
]
TABLE_3_1 = replace(A, horizon=14)
TABLE_3_7 = replace(A, horizon=12, num_vehicles=5)


@given(st.sampled_from(SHORT), tasks(), st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_responses_are_those_of_a_simulation(config: FdiConfig, task: Task, seed: int) -> None:
    generator = np.random.default_rng(seed)
    lifted, flags = lift(config, task.sensors), task.sensors.flags(4)
    levels = generator.integers(-lifted.levels, lifted.levels + 1, (config.horizon, task.sensors.count))
    start = generator.normal(size=8)
    course, z = play(config, task.sensors, levels, start), levels.reshape(-1)
    np.testing.assert_allclose(lifted.errors @ z + lifted.drift @ start, course.errors, atol=1e-9)
    np.testing.assert_allclose(lifted.commands @ z + lifted.drift_commands @ start, course.commands, atol=1e-9)
    np.testing.assert_allclose(
        lifted.readings @ z + lifted.drift_readings @ start, course.readings[:, flags], atol=1e-9
    )


@given(st.sampled_from(SHORT), tasks(), st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_rows_say_what_is_legal(config: FdiConfig, task: Task, seed: int) -> None:
    generator = np.random.default_rng(seed)
    lifted, n = lift(config, task.sensors), config.num_vehicles
    levels = generator.integers(-3, 4, (config.horizon, task.sensors.count)) * generator.integers(0, 5)
    course = play(config, task.sensors, levels)
    spoofed = course.readings[:, :n][:, task.sensors.flags(n)[:n]]
    excess = [
        course.commands.max() - config.max_acceleration_mps2,
        config.min_acceleration_mps2 - course.commands.min(),
        -config.desired_gap_m - spoofed.min(initial=0.0),
        -config.desired_gap_m - course.errors[1:-1, :n].min(),
    ]
    rows = legal_rows(config, task.sensors, config.horizon)
    assert violation(rows, levels.reshape(-1)) == pytest.approx(max(0.0, *excess), abs=2e-7)
    assert rows.matrix.shape[1] == len(lifted.levels) * config.horizon


def test_nothing_is_imposed_after_the_last_step_but_its_own_row() -> None:
    """A gap may be past a collision at m; at m - 1 it may not."""
    sensors, z = parse_sensors("x4", 4), np.full(20, 10.0)
    gap_m = lift(A, sensors).errors[:, 3] @ z
    end = end_rows(A, sensors, 20, 3, -np.inf, gap_m[20])
    assert violation(end, z) == pytest.approx(0, abs=1e-12)
    assert violation(end_rows(A, sensors, 20, 3, -np.inf, gap_m[20] - 1), z) == pytest.approx(1)
    for steps in (19, 20):
        rows = legal_rows(replace(A, desired_gap_m=1.0, limit_commands=False), sensors, steps)
        assert rows.matrix.shape == (4 * (steps - 1) + steps, steps)


def test_strict_rows_are_inside_the_others() -> None:
    wide, strict = (legal_rows(A, parse_sensors("xv1,2", 4), 20, strict=strict) for strict in (False, True))
    assert (wide.matrix != strict.matrix).nnz == 0
    assert np.all(wide.lower < strict.lower)
    assert np.all(wide.upper[np.isfinite(wide.upper)] > strict.upper[np.isfinite(strict.upper)])


def test_matrices_are_shared_and_read_only() -> None:
    assert lift(A, parse_sensors("x1", 4)) is lift(A, parse_sensors("x1", 4))
    with pytest.raises(ValueError, match="read-only"):
        lift(A, parse_sensors("x1", 4)).errors[0, 0, 0] = 1.0


def test_both_sensors_of_a_vehicle_are_one_whole_number() -> None:
    assert joint_ratio(A) is not None
    assert str(joint_ratio(A)) == "2/3"  # 1 * 0.5 m to 3 * 0.25 m/s
    assert str(joint_ratio(B)) == "4/5"
    assert joint_ratio(replace(A, derivative_gain=2**0.5)) is None


@given(st.sampled_from([A, B, replace(A, derivative_gain=2**0.5)]), tasks(most=4), st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_variables_and_levels_belong_to_each_other_one_to_one(config: FdiConfig, task: Task, seed: int) -> None:
    config, generator = replace(config, horizon=10), np.random.default_rng(seed)
    columns, lifted = columns_of(config, task.sensors), lift(config, task.sensors)
    for matrix in (columns.transform, columns.inverse):
        assert np.all(matrix.data == np.rint(matrix.data))
    np.testing.assert_array_equal((columns.transform @ columns.inverse).toarray(), np.eye(10 * task.sensors.count))
    levels = generator.integers(-lifted.levels, lifted.levels + 1, (10, task.sensors.count)).reshape(-1)
    variables = columns.inverse @ levels
    assert np.all(np.abs(variables) <= columns.bound)
    assert violation(columns.rows, variables) == 0
    bounded = set(range(10 * task.sensors.count)) - set(columns.rows.matrix.nonzero()[1])
    over = columns.inverse @ np.tile(lifted.levels + 1, 10)
    assert violation(columns.rows, over) >= 1 or any(abs(over[place]) > columns.bound[place] for place in bounded)


def test_only_one_variable_of_a_vehicle_with_both_sensors_moves_the_platoon() -> None:
    sensors = parse_sensors("xv3", 4)
    moved = lift(A, sensors).errors[20] @ columns_of(A, sensors).transform.toarray()
    assert np.abs(moved[:, 0::2]).max() < 1e-12
    assert np.abs(moved[:, 1::2]).max(axis=0).min() > 1e-4


@pytest.mark.parametrize("name", ["x1>1", "x2>2", "x4>4", "v4>4"])
def test_a_hit_has_a_legal_plan(name: str) -> None:
    found = reach(TABLE_3_1, parse_task(name, 4))
    assert found.hit is True
    assert found.injections is not None
    course = play(TABLE_3_1, found.task.sensors, found.injections)
    end = course.errors[-1][[found.task.target - 1, 4 + found.task.target - 1]]
    assert found.end == pytest.approx(tuple(end))
    assert min(np.hypot(end[0] + 5, end[1] - speed_mps) for speed_mps in GRID_MPS) <= 0.45
    assert found.task.target in collisions(TABLE_3_1, found.task, found.injections)


def test_a_plan_that_ends_there_is_taken() -> None:
    task = parse_task("x1>1", 4)
    first = reach(TABLE_3_1, task)
    assert first.injections is not None
    np.testing.assert_array_equal(reach(TABLE_3_1, task, plan=first.injections).injections, first.injections)


def test_the_relaxation_settles_unreachable_cells() -> None:
    assert reach(TABLE_3_1, parse_task("x4>1", 4)).hit is False


def test_what_ends_by_its_nodes_is_open() -> None:
    """Tables 3.7 at its fitted horizon; the same with any load of the machine."""
    assert reach(TABLE_3_7, parse_task("v1,3>3", 5), nodes=1).hit is None


def test_a_stricter_acceptance_reaches_no_more() -> None:
    assert reach(TABLE_3_1, parse_task("x1>1", 4), acceptance=1e-5).hit is not True
