"""The sampled platoon against scipy, the anchors of the specification and an integration vehicle by vehicle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from cps_envs.core.discretisation import matrix_exponential, zero_order_hold
from cps_envs.core.types import Array
from cps_envs.fdi.config import FIG_3_2, A
from cps_envs.fdi.model import platoon_model
from tests.fdi.reference import Platoon, exact_step

DIAGONAL = (0.974067, 0.975839, 0.976118, 0.985849, 0.342262, 0.403949, 0.417947, 0.624996)


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
