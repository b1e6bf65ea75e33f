from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from cps_baselines.fdi import cross as module
from cps_baselines.fdi.cross import cross, merged, relaxation_mps
from cps_baselines.fdi.replay import NoReplayError, replay
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import IntArray
from cps_envs.fdi.config import A, FdiConfig
from cps_envs.fdi.optima import GAP_REACHED, INFEASIBLE, PROVED, TIME_LIMIT, Record
from cps_envs.fdi.task import Task, all_tasks, parse_task
from cps_paper.fdi.interpretations import CLIP, B, C
from tests.fdi.reference import ANCHORS, play, tasks

LEAD = parse_task("x4>4", 4)
TASKS = [*all_tasks(4, 1), *all_tasks(4, 2)]
SLOW = {False: (), True: pytest.mark.slow}
RELAXED = {"x1,2>1": 4.7016, "v1,2>1": 8.8845, "xv4>4": 7.1509}


def check(config: FdiConfig, record: Record) -> None:
    """An attack that is legal in every row, collides first at the end, and is as fast as it says."""
    if record.injections is None:
        assert record.value_mps is None
        return
    n, target, gap_m = config.num_vehicles, record.task.target - 1, config.desired_gap_m
    assert record.injections.dtype == np.int64
    course = play(config, record.task.sensors, record.injections)
    ranges = record.task.sensors.flags(n)[:n]
    assert np.all(course.commands <= config.max_acceleration_mps2 + 1e-6)
    assert np.all(course.commands >= config.min_acceleration_mps2 - 1e-6)
    assert np.all(course.readings[:, :n][:, ranges] >= -gap_m - 1e-6)
    assert np.all(course.errors[:-1, :n] > -gap_m)
    assert course.errors[-1, target] <= -gap_m
    assert record.value_mps == pytest.approx(max(0.0, -course.errors[-1, n + target]), abs=1e-6)
    assert record.lp_mps is not None
    assert record.value_mps <= record.bound_mps <= record.lp_mps + 1e-6


@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW[name == "x3>4"]) for name in ANCHORS])
def test_anchors(name: str) -> None:
    record = cross(A, parse_task(name, 4), time_limit_s=120)
    assert record.status == PROVED
    assert record.lp_mps == pytest.approx(ANCHORS[name].relaxed, abs=6e-5)
    assert record.value_mps == pytest.approx(ANCHORS[name].optimum, abs=6e-5)
    assert record.bound_mps == pytest.approx(ANCHORS[name].optimum, abs=2e-4)
    check(A, record)


@pytest.mark.parametrize("name", RELAXED)
def test_relaxations(name: str) -> None:
    assert relaxation_mps(A, parse_task(name, 4)) == pytest.approx(RELAXED[name], abs=6e-5)


def test_two_sensors_of_a_vehicle_are_proved_fast() -> None:
    record = cross(A, parse_task("xv4>4", 4), time_limit_s=60)
    assert (record.status, record.value_mps) == (PROVED, pytest.approx(7.0393, abs=6e-5))
    check(A, record)


@given(tasks(most=2))
@settings(max_examples=10)
def test_values_lie_below_bounds_and_attacks_are_legal(task: Task) -> None:
    config = replace(A, horizon=12)
    record = cross(config, task, time_limit_s=0.5)
    check(config, record)
    assert record.status in (PROVED, INFEASIBLE, TIME_LIMIT)
    assert (record.status == PROVED) <= record.feasible


@pytest.mark.parametrize("config", [B, CLIP], ids=["B", "clip"])
def test_other_constants(config: FdiConfig) -> None:
    config = replace(config, horizon=int(2.6 / config.dt_s))
    record = cross(config, parse_task("x4>4", 4), time_limit_s=20, gap=0.05)
    assert record.feasible
    check(config, record)


def test_more_sensors_are_no_slower() -> None:
    speeds = {name: cross(A, parse_task(f"{name}>4", 4), time_limit_s=60) for name in ("x4", "v4", "xv4")}
    assert all(record.status == PROVED for record in speeds.values())
    assert speeds["xv4"].bound_mps >= max(speeds["x4"].value_mps or 0, speeds["v4"].value_mps or 0)


@given(tasks(most=2))
@settings(max_examples=20)
def test_relaxations_grow_with_the_sensors_and_with_time(task: Task) -> None:
    alone = relaxation_mps(A, task)
    longer = relaxation_mps(replace(A, horizon=23), task)
    joined = relaxation_mps(A, replace(task, sensors=parse_task("xv1,2,3,4>1", 4).sensors))
    assert joined is not None
    if alone is not None:
        assert longer is not None
        assert longer >= alone - 1e-6
        assert joined >= alone - 1e-6


def test_a_longer_horizon_is_no_slower() -> None:
    values = [cross(replace(A, horizon=steps), parse_task("x4>4", 4)).value_mps or 0 for steps in (12, 16, 20)]
    assert values == sorted(values)


def test_an_infeasible_relaxation_is_the_certificate_of_an_unreachable_target() -> None:
    record = cross(A, parse_task("x4>1", 4))
    assert (record.lp_mps, record.value_mps, record.bound_mps, record.status) == (None, None, 0.0, INFEASIBLE)


def test_whole_levels_can_be_infeasible_where_continuous_ones_are_not() -> None:
    record = cross(A, parse_task("x1>2", 4))
    assert record.lp_mps == pytest.approx(1.1350, abs=6e-5)
    assert (record.value_mps, record.bound_mps, record.status) == (None, 0.0, INFEASIBLE)


@pytest.mark.parametrize("config", [A, B, C, CLIP], ids=["A", "B", "C", "clip"])
def test_nobody_collides_before_the_first_feasible_step(config: FdiConfig) -> None:
    """Both vehicles of a pair accelerate as hard as they may: x_d <= (u_max - u_min) (k dt)^2 / 2."""
    earlier = config.fewest_steps - 1
    closing_mps2 = config.max_acceleration_mps2 - config.min_acceleration_mps2
    assert closing_mps2 / 2 * (earlier * config.dt_s) ** 2 < config.desired_gap_m
    with pytest.raises(ConfigurationError, match="first feasible step"):
        replace(config, horizon=earlier)
    short = _unchecked(config, earlier)
    assert all(relaxation_mps(short, task) is None for task in TASKS)


def _unchecked(config: FdiConfig, horizon: int) -> FdiConfig:
    """A configuration with a horizon that it would refuse."""
    short = replace(config)
    object.__setattr__(short, "horizon", horizon)
    return short


def test_euler_with_a_large_step_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="unstable without any attack"):
        replace(A, discretisation="euler")


def test_time_is_kept_and_a_value_remains() -> None:
    started = time.process_time()
    record = cross(A, parse_task("x1,2>1", 4), time_limit_s=1)
    assert time.process_time() - started < 5
    assert record.status == TIME_LIMIT
    check(A, record)


def test_a_gap_to_stop_at() -> None:
    record = cross(A, parse_task("x3>3", 4), time_limit_s=60, gap=0.05)
    assert record.status in (GAP_REACHED, PROVED)
    assert record.gap is not None
    assert record.gap <= 0.05


def test_a_start_is_never_lost() -> None:
    task = parse_task("x1,2>1", 4)
    known = cross(A, parse_task("x1>1", 4)).injections
    assert known is not None
    start = np.column_stack([known, np.zeros(20, np.int64)])
    record = cross(A, task, time_limit_s=0.05, start=start)
    assert record.value_mps is not None
    assert record.value_mps >= 3.4074
    check(A, record)
    nonsense = cross(A, task, time_limit_s=0.5, start=np.full((20, 2), 100))
    check(A, nonsense)


def test_a_solution_that_touches_a_collision_is_searched_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[IntArray] = []

    def play_once(config: FdiConfig, task: Task, injections: IntArray) -> float:
        calls.append(injections)
        if len(calls) == 1:
            raise NoReplayError("touches")
        return replay(config, task, injections)

    monkeypatch.setattr(module, "replay", play_once)
    record = cross(A, LEAD)
    assert len(calls) > 1
    assert (record.status, record.value_mps) == (PROVED, pytest.approx(6.5151, abs=6e-5))


def test_what_two_searches_know_together() -> None:
    task = parse_task("x1,2>1", 4)
    slow = Record(task, 4.7, 4.4, 4.6, TIME_LIMIT, 1.0)
    assert merged(slow, Record(task, 4.7, 4.3, 4.5, TIME_LIMIT, 2.0)) == Record(task, 4.7, 4.4, 4.5, TIME_LIMIT, 3.0)
    assert merged(slow, Record(task, 4.7, 4.5, 4.7, TIME_LIMIT, 2.0)) == Record(task, 4.7, 4.5, 4.6, TIME_LIMIT, 3.0)
    assert merged(slow, Record(task, 4.7, None, 4.40001, TIME_LIMIT, 2.0)).status == PROVED
    nothing = Record(task, 4.7, None, 4.6, TIME_LIMIT, 1.0)
    assert merged(nothing, Record(task, 4.7, None, 0.0, INFEASIBLE, 1.0)).status == INFEASIBLE


@pytest.fixture(scope="module")
def plan() -> IntArray:
    """The optimal attack of x4>4."""
    injections = cross(A, LEAD).injections
    assert injections is not None
    return injections


def test_replay(plan: IntArray) -> None:
    assert replay(A, LEAD, plan) == pytest.approx(6.5151, abs=6e-5)
    waited = np.vstack([np.zeros((1, 1), np.int64), plan])
    assert replay(replace(A, horizon=21), LEAD, waited) == pytest.approx(6.5151, abs=6e-5)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda plan: plan[:-1], "does not collide"),
        (lambda plan: np.full((1, 1), 11), "step 0: a commanded acceleration of 0.0000 to 5.5000"),
        (lambda plan: np.full((1, 1), 101), "exceeds the largest"),
        (lambda plan: plan[:0], "do not fit"),
        (lambda plan: plan[[*range(20), 19]], "do not fit"),
    ],
)
def test_replay_refuses(plan: IntArray, change: Callable[[IntArray], IntArray], reason: str) -> None:
    with pytest.raises(NoReplayError, match=reason):
        replay(A, LEAD, change(plan))


def test_replay_refuses_early_collisions(plan: IntArray) -> None:
    with pytest.raises(NoReplayError, match="collides at step 20"):
        replay(replace(A, horizon=21), LEAD, np.vstack([plan, plan[-1:]]))


def test_replay_refuses_ranges_below_zero() -> None:
    with pytest.raises(NoReplayError, match="spoofed range"):
        replay(replace(A, limit_commands=False), LEAD, np.full((1, 1), -11))
