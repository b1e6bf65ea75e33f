"""Sensors, tasks and configurations in text form, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.config import configure
from cps_envs.core.errors import ConfigurationError
from cps_envs.fdi.config import PRESETS, A
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.sensors import Sensors, parse_sensors
from cps_envs.fdi.task import Task, all_tasks, parse_task

subsets = st.sets(st.integers(1, 12), max_size=12).map(sorted).map(tuple)


@pytest.mark.parametrize(
    ("text", "ranges", "rates"),
    [("x1", (1,), ()), ("v13", (), (1, 3)), ("xv14", (1, 4), (1, 4)), ("x1+v3", (1,), (3,)), ("v3,1", (), (1, 3))],
)
def test_the_papers_notation(text: str, ranges: tuple[int, ...], rates: tuple[int, ...]) -> None:
    assert parse_sensors(text, 4) == Sensors(ranges, rates)


def test_vehicle_ten_is_one_vehicle_in_a_platoon_of_ten() -> None:
    assert parse_sensors("x10", 10) == Sensors((10,))
    assert parse_sensors("x1,10", 10) == Sensors((1, 10))


@given(subsets, subsets)
def test_sensors_survive_their_text(ranges: Any, rates: Any) -> None:
    if ranges or rates:
        sensors = Sensors(ranges, rates)
        assert parse_sensors(str(sensors), 12) == sensors
        assert parse_task(f"{sensors}>5", 12) == Task(sensors, 5)


def test_flags_mark_ranges_then_rates() -> None:
    assert parse_sensors("x1+v3", 4).flags(4).nonzero()[0].tolist() == [0, 6]


def test_the_tables_have_120_tasks() -> None:
    tasks = [*all_tasks(4, 1), *all_tasks(4, 2)]
    assert len(set(tasks)) == len(tasks) == 120


def test_a_sensor_that_nobody_attacks_needs_no_injection() -> None:
    assert configure(A, {"attacked": "x4", "max_rate_injection_mps": 0.2}).rate_levels == 0
    assert configure(A, {"attacked": "v4", "max_range_injection_m": 0.4}).range_levels == 0
    assert configure(A, {"attacked": "x4", "max_range_injection_m": 0.5}).range_levels == 1


def test_unknown_constants_have_no_feasible_tasks() -> None:
    config = configure(PRESETS["easy"], {"proportional_gain": 1.234})
    with pytest.raises(ConfigurationError, match="cps-envs oracle"):
        FdiGame(config, 1)
