"""The sampled platoon against scipy and an integration vehicle by vehicle; sensors and tasks in text form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from cps_envs.core.compute.discretisation import matrix_exponential, zero_order_hold
from cps_envs.core.declare.config import configure
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.fdi.config import PRESETS, A
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.model import platoon_model
from cps_envs.fdi.sensors import Sensors, parse_sensors
from cps_envs.fdi.task import Task, all_tasks, parse_task
from cps_paper.fdi.interpretations import FIG_3_2
from tests.fdi.reference import Platoon, exact_step

DIAGONAL = (0.974067, 0.975839, 0.976118, 0.985849, 0.342262, 0.403949, 0.417947, 0.624996)
subsets = st.sets(st.integers(1, 12), max_size=12).map(sorted).map(tuple)


def test_anchors_of_the_specification() -> None:
    model = A.model
    np.testing.assert_allclose(np.diag(model.transition), DIAGONAL, atol=5e-7)
    assert model.spectral_radius == pytest.approx(0.964462, abs=5e-7)
    np.testing.assert_allclose(model.injection[[0, 4], 0], [-0.014151, -0.120284], atol=5e-7)
    np.testing.assert_allclose(model.injection[[3, 7], 7], [-0.042454, -0.360852], atol=5e-7)


@given(st.integers(1, 8), st.floats(0.0, 20.0), st.integers(0, 2**31))
def test_exponential_is_scipys(size: int, scale: float, seed: int) -> None:
    matrix = scale * np.random.default_rng(seed).standard_normal((size, size)) / size
    expected = expm(matrix)
    np.testing.assert_allclose(matrix_exponential(matrix), expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_zero_order_hold_is_scipys() -> None:
    generator = np.random.default_rng(0)
    a, b = generator.standard_normal((4, 4)), generator.standard_normal((4, 2))
    for ours, theirs in zip(zero_order_hold(a, b, 0.3), exact_step(a, b, 0.3), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


@pytest.mark.parametrize("num_vehicles", [2, 4, 7])
def test_zero_order_hold_is_the_continuous_platoon(num_vehicles: int) -> None:
    from dataclasses import replace

    config = replace(A, num_vehicles=num_vehicles, attacked="x1", target=1)
    platoon, model, generator = Platoon(config), config.model, np.random.default_rng(num_vehicles)
    error = np.zeros(2 * num_vehicles)
    for _ in range(10):
        injection = generator.normal(0, 1, 2 * num_vehicles)
        platoon.step_continuous(injection)
        error = model.transition @ error + model.injection @ injection
        np.testing.assert_allclose(error, platoon.errors, atol=1e-9)


def test_held_commands_are_the_double_integrators() -> None:
    model = platoon_model(3, 1.0, 3.0, 0.1, "zohu")
    held = model.coast + model.command @ model.feedback
    np.testing.assert_allclose(model.transition, held, atol=1e-15)
    np.testing.assert_allclose(model.command, np.vstack([0.005 * drive(3), 0.1 * drive(3)]), atol=1e-15)


def test_euler_is_a_small_step_of_the_same_flow() -> None:
    fine = platoon_model(4, 1.0, 3.0, 1e-6, "zoh")
    euler = platoon_model(4, 1.0, 3.0, 1e-6, "euler")
    for exact, first_order in zip(fine[2:5], euler[2:5], strict=True):
        np.testing.assert_allclose(exact, first_order, atol=1e-10)


def test_the_figures_platoon_is_stable() -> None:
    assert FIG_3_2.model.spectral_radius < 1


def test_models_are_shared_and_read_only() -> None:
    assert A.model is platoon_model(4, 1.0, 3.0, 0.2, "zoh")
    with pytest.raises(ValueError, match="read-only"):
        A.model.transition[0, 0] = 0


def drive(n: int) -> Array:
    return np.eye(n, k=1) - np.eye(n)


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
    with pytest.raises(ConfigurationError, match="cps-envs certify"):
        FdiGame(config, 1)
