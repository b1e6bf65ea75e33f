"""Heat that drifts, an outside that is not as forecast, and how many sensors are compromised."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.compute.generators import seeded
from cps_envs.core.compute.kernels import kernel, room
from cps_envs.core.types import Array, FloatArray
from cps_envs.hvac.building import discretise
from cps_envs.hvac.config import HARD, LEARNING, PAPER
from cps_envs.hvac.disturbance import add_steps, slow_course
from tests.hvac.games import go, started
from tests.hvac.reference import matrices

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
DRIFTING = {"heat_drift_w": (50.0, 150.0), "unmeasured_heat_w": 50.0, "forecast_bias_c": 1.0, "forecast_drift_c": 1.0}
QUIET = {"compromised_weights": (1.0,), "noise_std_c": 0.0}


def correlation(course: Array, lag: int) -> float:
    """Of a course of mean 0 and variance 1, over environments and zones, at a lag in steps."""
    return float((course[:, lag:] * course[:, :-lag]).mean() / (course**2).mean())


def test_the_plant_follows_the_drawn_courses() -> None:
    game = started([3], window_steps=30, **DRIFTING)
    state, building = game.state, discretise(PAPER)
    x, outside = state.temperature[0].copy(), np.array([0.0, 0.0, 1.0, 1.0])
    for k in range(60):
        go(game, 0)
        heat = state.heating[0] + state.heat[0] + state.heat_drift[0, k]
        w = game.constants.weather[k] + outside * state.outdoor_error[0, k]
        x = state.plant[0] @ x + building.B * heat + building.G * w
        np.testing.assert_allclose(state.temperature[0], x, rtol=1e-12)
        x = state.temperature[0].copy()


def test_drift_has_the_size_that_was_drawn_for_each_zone() -> None:
    course = started(range(300), heat_drift_w=100.0).state.heat_drift
    assert np.sqrt((course**2).mean()) == pytest.approx(100.0, rel=0.03)
    ranged = started(range(300), heat_drift_w=(50.0, 150.0)).state.heat_drift
    assert np.sqrt((ranged**2).mean()) == pytest.approx(np.sqrt((150**3 - 50**3) / 300), rel=0.03)
    sizes = np.sqrt((ranged**2).mean(axis=1))
    assert sizes.std() > 1.3 * np.sqrt((course**2).mean(axis=1)).std()


def test_half_of_the_drift_is_slow_and_half_comes_in_steps() -> None:
    course = started(range(400), heat_drift_w=100.0).state.heat_drift
    for lag in (10, 60, 150):  # steps of 1/30 h
        hours = lag / 30.0
        expected = 0.5 * np.exp(-hours / 4.0) + 0.5 * np.exp(-hours / 3.0)
        assert correlation(course, lag) == pytest.approx(expected, abs=0.03)
    slow = started(range(50), heat_drift_w=100.0, drift_hold_h=1e4).state.heat_drift
    assert (np.abs(np.diff(slow, axis=1)) > 60.0).mean() < 1e-3  # steps are gone: one in 10,000 h


def test_the_outside_differs_from_the_forecast_by_bias_and_drift() -> None:
    biased = started(range(500), forecast_bias_c=1.5).state.outdoor_error
    assert (biased == biased[:, :1]).all()
    assert biased[:, 0].std() == pytest.approx(1.5, rel=0.1)
    drifting = started(range(300), forecast_drift_c=1.5).state.outdoor_error[:, :, np.newaxis]
    assert np.sqrt((drifting**2).mean()) == pytest.approx(1.5, rel=0.05)
    assert correlation(drifting, 60) == pytest.approx(np.exp(-0.5), abs=0.05)


def test_nobody_sees_the_outside_but_as_forecast() -> None:
    wrong, exact = started([1], forecast_bias_c=5.0), started([1])
    for game in (wrong, exact):
        go(game, 0, num_steps=5)
    assert wrong.state.outdoor_error[0, 0] != 0.0
    for field in ("outdoor_c",):
        np.testing.assert_array_equal(
            *(game.fields["defender"].decode_field(field, game.observe("defender")) for game in (wrong, exact))
        )
    assert (wrong.state.temperature != exact.state.temperature).any()


def test_what_is_left_out_draws_nothing_and_takes_no_room() -> None:
    plain, drifting = started([5], preset="easy"), started([5], preset="easy", heat_drift_w=80.0)
    assert plain.state.heat_drift.shape == (1, 0, 4)
    assert plain.state.outdoor_error.shape == (1, 0)
    for name in ("series", "plant", "heat", "compromised", "onset"):
        np.testing.assert_array_equal(getattr(plain.state, name)[0], getattr(drifting.state, name)[0], err_msg=name)
    once, again = np.random.default_rng(0), np.random.default_rng(0)
    everything = np.ones(1, bool)
    plain.reset(everything, [once])
    drifting.reset(everything, [again])
    assert once.random() != again.random()


def test_a_generator_goes_on_as_before_where_nothing_is_new() -> None:
    """What a reset of `easy` draws: noise, onset, number, order, entries of the plant, heat."""
    generator, expected = np.random.default_rng(8), np.random.default_rng(8)
    game = started([0], preset="easy")
    game.reset(np.ones(1, bool), [generator])
    expected.standard_normal((720, 4))
    expected.integers(100, 401), expected.integers(1, 4)
    expected.permutation(4)
    expected.random((4, 4))
    expected.random(4)
    assert generator.random() == expected.random()


def test_the_number_of_liars_follows_its_weights() -> None:
    game = started(range(2000), preset="learning")
    counts = np.bincount(game.state.compromised.sum(axis=1), minlength=5) / 2000
    assert counts == pytest.approx([0.2, 0.3, 0.3, 0.2, 0.0], abs=0.03)
    assert game.state.onset.min() >= LEARNING.window_steps
    assert started(range(50), compromised_weights=(0.0, 0.0, 0.0, 0.0, 2.0)).state.compromised.all()
    assert not started(range(50), compromised_weights=(1.0,)).state.compromised.any()


def test_hard_is_learning_with_more_drift() -> None:
    assert (
        dataclasses.replace(HARD, heat_drift_w=LEARNING.heat_drift_w, filter_heat_w=LEARNING.filter_heat_w) == LEARNING
    )
    assert HARD.heat_drift_w == 150.0


@kernel
def make_courses(streams: Array, kept: float, held: float, slow: FloatArray, stepped: FloatArray) -> None:
    slow_course(slow, kept)
    add_steps(streams[0], held, stepped, room(stepped.shape[1]))


@settings(max_examples=25, deadline=None)
@given(kept=st.floats(0.0, 1.0), held=st.floats(0.0, 1.0), seed=st.integers(0, 2**32))
def test_courses_stay_what_they_are_where_nothing_changes(kept: float, held: float, seed: int) -> None:
    generator = np.random.default_rng(seed)
    normal, uniform = generator.standard_normal((40, 3)), generator.random((40, 3))
    slow, stepped = normal.copy(), np.zeros((40, 3))
    make_courses(seeded([seed]).streams, kept, held, slow, stepped)
    assert (slow[0] == normal[0]).all()
    np.testing.assert_allclose(slow[1:] - kept * slow[:-1], np.sqrt(1 - kept**2) * normal[1:], atol=1e-12)
    stays = np.diff(stepped, axis=0) == 0.0
    assert (stays == (uniform[1:] < held)).all()
    assert (stepped[1:][~stays] == normal[1:][~stays]).all()


def test_a_cold_climate_makes_lies_of_both_signs_matter() -> None:
    """What heating has to supply at 25 C is above 0 in every zone at any hour, so that it can be raised and lowered."""
    A_c = matrices()[0]
    cold = started([0], preset="learning", **QUIET).constants.weather
    walls, capacity = np.array(LEARNING.wall_resistance_k_per_w), np.array(LEARNING.heat_capacity_j_per_k)
    needed = -(capacity * (A_c @ np.full(4, 25.0))) - cold / walls
    assert needed.min() > 20.0
    warm = started([0]).constants.weather
    assert (-(capacity * (A_c @ np.full(4, 25.0))) - warm / walls).min() < 0.0
