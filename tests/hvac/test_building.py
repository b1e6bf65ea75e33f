"""The building, its controller and its observer as matrices, against printed values and independent statements."""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from cps_envs.core.types import Array
from cps_envs.hvac.building import Building, conductances, discretise, outdoor, transition, weather
from cps_envs.hvac.config import PAPER, HvacConfig
from cps_envs.hvac.controller import feedforward, gains, predict
from cps_envs.hvac.model import build_model
from cps_envs.hvac.moving_horizon import ObservabilityWarning, observability, powers, set_gains
from cps_envs.hvac.sensors import attack_order, membership, sensor_sets, zones_of_sensors
from tests.hvac import reference
from tests.hvac.games import go, started

PRINTED_A = """0.965797 0.014423 0.019231 0; 0.010135 0.978704 0 0.009539;
               0.028571 0 0.961277 0.007295; 0 0.012834 0.004642 0.981069"""
FIRST_PAPER_SETS = [(4,), (3,), (3, 4), (2,), (2, 4), (2, 3), (2, 3, 4), (1,), (1, 4), (1, 3), (1, 3, 4), (1, 2)]


def printed(found: Array, text: str, digits: int) -> None:
    """Whether values agree with printed ones to the last printed digit."""
    expected = np.array([[float(number) for number in row.split()] for row in text.split(";")]).squeeze()
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.5001 * 10.0**-digits)


def test_matrices_are_those_printed_in_the_specification() -> None:
    building = discretise(PAPER)
    printed(building.A, PRINTED_A, 6)
    printed(np.sort(np.linalg.eigvals(building.A)), "0.937314 0.970281 0.980764 0.998488", 6)
    printed(1e4 * building.B, "2.3077 1.6216 3.4286 2.1818", 4)
    printed(1e4 * building.G, "5.4945 16.216 28.571 14.545", 3)
    printed(-120 / np.log(np.sort(np.linalg.eigvals(building.A))) / 3600, "0.515 1.105 1.716 22.03", 2)


def test_matrices_are_those_of_the_independent_reference() -> None:
    A_c, A, B, G = reference.matrices()
    building = discretise(PAPER)
    np.testing.assert_allclose(conductances(PAPER), A_c, rtol=1e-12, atol=1e-20)
    for ours, theirs in zip(building, (A, B.diagonal(), G.diagonal()), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(weather(PAPER, 120.0 * np.arange(800)), reference.weather(), rtol=1e-12)


capacities = st.floats(2e5, 2e6)


@given(
    capacity=st.lists(capacities, min_size=2, max_size=6),
    walls=st.lists(st.floats(0.05, 1.0), min_size=6, max_size=6),
    links=st.sets(st.tuples(st.integers(0, 5), st.integers(0, 5)).filter(lambda pair: pair[0] < pair[1]), max_size=5),
    resistance=st.floats(0.02, 0.5),
)
def test_a_building_of_any_zones_balances_its_heat(capacity: Any, walls: Any, links: Any, resistance: float) -> None:
    zones = len(capacity)
    links = sorted(pair for pair in links if pair[1] < zones)
    config = dataclasses.replace(
        PAPER,
        heat_capacity_j_per_k=tuple(capacity),
        wall_resistance_k_per_w=tuple(walls[:zones]),
        link_zones=tuple(zone + 1 for pair in links for zone in pair),
        link_resistance_k_per_w=(resistance,) * len(links),
        ground_zones=(1,),
        num_sensors=zones,
        num_compromised=1,
        step_s=60.0,
    )
    building = discretise(config)
    np.testing.assert_allclose(building.A.sum(axis=1) + building.G, 1.0, atol=1e-12)  # at one temperature nothing moves
    stored = np.array(capacity)[:, np.newaxis] * building.A
    np.testing.assert_allclose(stored, stored.T, rtol=1e-9, atol=1e-6)  # what one zone gives, the other gets
    assert (building.A >= 0).all()
    assert np.abs(np.linalg.eigvals(building.A)).max() < 1


def test_a_plant_that_is_off_has_entries_of_a_c_off() -> None:
    beta = np.full((4, 4), 0.1)
    expected = np.eye(4) + 1.1 * (discretise(PAPER).A - np.eye(4))
    np.testing.assert_allclose(transition(PAPER, beta), expected, atol=1e-15)


def test_outside_is_warmest_at_six() -> None:
    assert np.argmax(outdoor(PAPER, 120.0 * np.arange(720))) == 180
    assert outdoor(PAPER, 120.0 * np.arange(720))[[0, 180, 540]] == pytest.approx([23, 34, 12])


def test_gains_are_those_printed_in_the_specification() -> None:
    long, short = gains(discretise(PAPER), 80, 0.25), gains(discretise(PAPER), 20, 0.25)
    printed(long.K_e[0], "1.292126 0.198321 0.315591 0.021501", 6)
    printed(long.K_d[0], "40.531650 20.509274 19.999326 7.787308", 6)
    printed(long.K_w[0, :4], "0.0226179 0.0328368 0.0569851 0.0110435", 7)
    assert short.K_e[0, 0] == pytest.approx(0.159995, abs=0.5e-6)
    assert short.K_d[0, 0] == pytest.approx(1.751951, abs=0.5e-6)


def test_gains_are_those_of_the_independent_reference() -> None:
    ours = gains(discretise(PAPER), 80, 0.25)
    for mine, theirs in zip(ours[:3], reference.gains(), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-9)


def roll_out(building: Building, x: Array, dx: Array, du: Array, dw: Array) -> Array:
    """x(k + 1..k + N) of the incremental form: each change follows from the one before."""
    reached = []
    for move, change in zip(du, dw, strict=True):
        dx = building.A @ dx + building.B * move + building.G * change
        x = x + dx
        reached.append(x)
    return np.concatenate(reached)


@given(seed=st.integers(0, 2**32 - 1), horizon=st.integers(1, 40))
@settings(max_examples=30)
def test_prediction_is_a_roll_out(seed: int, horizon: int) -> None:
    building, generator = discretise(PAPER), np.random.default_rng(seed)
    x, dx = generator.uniform(15, 35, 4), generator.normal(0, 1, 4)
    du, dw = generator.normal(0, 100, (horizon, 4)), generator.normal(0, 1, (horizon, 4))
    M1, M2, M3, M4 = predict(building, horizon)
    predicted = M1 @ x + M2 @ dx + M3 @ du.ravel() + M4 @ dw.ravel()
    expected = roll_out(building, x, dx, du, dw)
    assert np.abs(predicted - expected).max() < 1e-12 * np.abs(expected).max()


def test_gains_minimise_the_cost() -> None:
    building, generator = discretise(PAPER), np.random.default_rng(1)
    x, dx, dw = generator.uniform(20, 30, 4), generator.normal(0, 0.1, 4), generator.normal(0, 0.1, (4, 4))

    def cost(flat: Any) -> Any:
        error = 25 - roll_out(building, x, dx, flat.reshape(4, 4), dw)
        return error @ error + 1e-4 * flat @ flat

    best = minimize(cost, np.zeros(16), method="BFGS", options={"gtol": 1e-9}).x[:4]
    K_e, K_d, K_w, _ = gains(building, 4, 1e-4)
    np.testing.assert_allclose(K_e @ (25 - x) - K_d @ dx - K_w @ dw.ravel(), best, rtol=1e-3, atol=1e-2)


def test_feedforward_looks_ahead_from_each_step() -> None:
    control, w = gains(discretise(PAPER), 80, 0.25), weather(PAPER, 120.0 * np.arange(800))
    ahead = feedforward(control, w, np.full_like(w, 25.0), 720)
    for k in (0, 1, 300, 719):
        before = w[max(k - 1, 0)]
        dw = np.diff(w[k : k + 80], axis=0, prepend=before[np.newaxis])
        np.testing.assert_allclose(ahead[k], control.K_w @ dw.ravel(), atol=1e-12)


def test_sets_and_their_order() -> None:
    assert list(sensor_sets(PAPER))[:12] == FIRST_PAPER_SETS
    assert list(sensor_sets(PAPER))[12:] == [(1, 2, 4), (1, 2, 3)]
    assert [a for a, sensors in enumerate(sensor_sets(PAPER), 1) if 2 not in sensors] == [1, 2, 3, 8, 9, 10, 11]
    eight = sensor_sets(dataclasses.replace(PAPER, num_sensors=8))
    assert len(eight) == len(set(eight)) == 64
    assert eight[:9] == ((4,), (8,), (3,), (3, 4), (3, 8), (7,), (4, 7), (7, 8), (2,))
    for sensors in eight:
        zones = [(sensor - 1) % 4 for sensor in sensors]
        assert 1 <= len(zones) == len(set(zones)) <= 3


def test_own_sets_are_separated_by_zeros() -> None:
    config = dataclasses.replace(PAPER, sensor_sets=(3, 1, 0, 2))
    assert sensor_sets(config) == ((1, 3), (2,))
    assert membership(config).tolist() == [[True, False, True, False], [False, True, False, False]]


def test_sensors_fall_in_the_paper_s_order() -> None:
    assert attack_order(PAPER) == (2, 1, 4, 3)
    assert attack_order(dataclasses.replace(PAPER, num_sensors=8)) == (2, 1, 4, 3, 6, 5, 8, 7)
    assert attack_order(dataclasses.replace(PAPER, attack_order=(3, 1))) == (3, 1)


@pytest.mark.parametrize("sensors", [4, 8])
@pytest.mark.parametrize("window", [100, 200])
def test_forward_form_is_the_pseudo_inverse(sensors: int, window: int) -> None:
    config = dataclasses.replace(PAPER, num_sensors=sensors)
    A, zone, member = discretise(config).A, zones_of_sensors(config), membership(config)
    gain, condition = set_gains(A, window, member, zone)
    steps = powers(A, window)
    for a, row in enumerate(member):
        O_a = observability(steps[:window], row, zone)
        ours = gain[a] @ O_a.T
        assert np.abs(ours - steps[window] @ np.linalg.pinv(O_a)).max() < 1e-9
        assert condition[a] == pytest.approx(np.linalg.cond(O_a), rel=1e-6)


@pytest.mark.parametrize("sensors", [4, 8])
def test_sums_that_all_sets_share_cost_no_accuracy(sensors: int) -> None:
    """O_a' r squares the condition of O_a, up to 3e3 here: estimates stay those of least squares to 1e-10 C."""
    config = dataclasses.replace(PAPER, num_sensors=sensors)
    A, zone, member = discretise(config).A, zones_of_sensors(config), membership(config)
    gain, _ = set_gains(A, config.window_steps, member, zone)
    steps, generator = powers(A, config.window_steps), np.random.default_rng(sensors)
    for a, row in enumerate(member):
        O_a = observability(steps[: config.window_steps], row, zone)
        readings = 3.0 + 0.45 * generator.standard_normal(len(O_a))
        expected = steps[config.window_steps] @ np.linalg.lstsq(O_a, readings, rcond=None)[0]
        np.testing.assert_allclose(gain[a] @ (O_a.T @ readings), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("window", "expected"), [(100, 400), (200, 163), (400, 135)])
def test_forward_form_is_well_conditioned(window: int, expected: int) -> None:
    A, zone = discretise(PAPER).A, zones_of_sensors(PAPER)
    s2 = np.array([[False, True, False, False]])
    assert set_gains(A, window, s2, zone)[1][0] == pytest.approx(expected, rel=0.01)  # printed rounded


def symmetric(**overrides: Any) -> HvacConfig:
    return dataclasses.replace(
        PAPER,
        heat_capacity_j_per_k=(0.5e6,) * 4,
        wall_resistance_k_per_w=(0.12,) * 4,
        link_resistance_k_per_w=(0.016,) * 4,
        **overrides,
    )


def test_a_symmetric_building_is_warned_about() -> None:
    with pytest.warns(ObservabilityWarning, match=r"sensor sets hardly observe.*\(4,\)"):
        build_model(symmetric())


def test_the_paper_s_building_is_not() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        build_model.__wrapped__(PAPER)


def test_a_set_that_sees_nothing_of_a_zone_leaves_it_at_the_forced_response() -> None:
    building = Building(np.diag([0.9, 0.8]), np.ones(2), np.ones(2))
    gain, condition = set_gains(building.A, 10, np.array([[True, False]]), np.array([0, 1]))
    assert np.isinf(condition[0])
    assert gain[0, 1] == pytest.approx([0, 0])


def test_models_are_shared() -> None:
    assert build_model(PAPER) is build_model(dataclasses.replace(PAPER))


def test_energy_is_heating_times_time() -> None:
    game, joules = started(num_steps=130, window_steps=100, onset_step=90), 0.0
    for _ in range(30):
        go(game)
        joules += game.state.heating[0].sum() * game.config.step_s
    assert joules > 0
    assert game.state.energy_j[0] == pytest.approx(joules)


@pytest.mark.parametrize("controller", ["levels", "clip"])
def test_on_levels_the_controller_goes_on_from_what_it_applied(controller: str) -> None:
    game, same = started(num_steps=130, window_steps=100, onset_step=90, controller=controller), []
    for _ in range(30):
        go(game)
        same.append(np.array_equal(game.state.integrator, game.state.heating))
    assert all(same) == (controller == "levels")
