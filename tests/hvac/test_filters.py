"""The Kalman filters that the defender is offered, against textbook equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.building import discretise
from cps_envs.hvac.config import LEARNING, PAPER, HvacConfig
from cps_envs.hvac.houses import house
from cps_envs.hvac.kalman import filter_gains, memory
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import filter_choice, filter_sets, membership, sensor_sets, zones_of_sensors
from tests.hvac.games import go, seen, started

FULL, EMPTY = (1, 2, 3, 4), ()


def augmented(config: HvacConfig) -> tuple[Array, ...]:
    """F, B, G (8, 8 or 4), Q of temperatures and heats, written from the text of `kalman`."""
    building, phi = discretise(config), memory(config)
    F = np.zeros((8, 8))
    F[:4, :4], F[:4, 4:], F[4:, 4:] = building.A, np.diag(building.B), phi * np.eye(4)
    Q = np.zeros((8, 8))
    Q[4:, 4:] = (1 - phi**2) * config.filter_heat_w**2 * np.eye(4)
    return F, building.B, building.G, Q


def test_every_set_all_and_none_are_offered() -> None:
    sets = sensor_sets(LEARNING)
    assert filter_sets(LEARNING) == (*sets, FULL, EMPTY)
    assert filter_sets(PAPER) == ()
    assert [filter_choice(LEARNING, sensors) for sensors in (sets[0], FULL, EMPTY)] == [16, 30, 31]
    assert HVAC.game(LEARNING, 1).action_space["defender"].n == 32
    with pytest.raises(ConfigurationError, match="kalman_filters"):
        filter_choice(PAPER, FULL)


@pytest.mark.parametrize("sensors", [FULL, (1,), (2, 4), EMPTY])
def test_gains_are_those_of_the_riccati_equation(sensors: tuple[int, ...]) -> None:
    F, _, _, Q = augmented(LEARNING)
    member, zone = membership(LEARNING, (sensors,)), zones_of_sensors(LEARNING)
    found = filter_gains(LEARNING, discretise(LEARNING), member, zone)
    H, R = np.eye(8)[:4], 0.2
    used = [sensor - 1 for sensor in sensors]
    if sensors:
        P = solve_discrete_are(F.T, H[used].T, Q, R * np.eye(len(used)))
        K = P @ H[used].T @ np.linalg.inv(H[used] @ P @ H[used].T + R * np.eye(len(used)))
        np.testing.assert_allclose(found.gain[0][:, used], K, atol=1e-9)
    else:
        P = Q.copy()
        for _ in range(20_000):
            P = F @ P @ F.T + Q
    left = [s for s in range(4) if s not in used]
    assert (found.gain[0][:, left] == 0).all()
    np.testing.assert_allclose(found.scale[0], 1 / np.sqrt(np.diag(H @ P @ H.T) + R), rtol=1e-7)


def test_filters_follow_their_equations_through_an_attack() -> None:
    game = started([2], preset="learning", compromised_weights=(0, 0, 1), onset_step=220, num_steps=300)
    F, B, G, _ = augmented(game.config)
    member, zone = membership(game.config, filter_sets(game.config)), zones_of_sensors(game.config)
    gains = filter_gains(game.config, discretise(game.config), member, zone)
    forged, share = absolute_action(game.config, np.full((1, 4), 21.0)), 120 / 7200
    z = np.tile(np.r_[np.full(4, 24.0), np.zeros(4)], (16, 1))
    mean = np.zeros((16, 4))
    for k in range(260):
        if k:
            z = z @ F.T
            z[:, :4] += B * game.state.heating[0] + G * game.constants.weather[k - 1]
        difference = game.state.reading[0] - z[:, zone]
        z = z + np.einsum("fis,fs->fi", gains.gain, difference)
        mean += share * (difference * gains.scale - mean)
        np.testing.assert_allclose(game.state.filtered[0], z, atol=1e-8)
        np.testing.assert_allclose(game.state.innovation[0], difference * gains.scale, atol=1e-8)
        np.testing.assert_allclose(game.state.innovation_mean[0], mean, atol=1e-8)
        choice = 16 + k % 16 if k >= 200 else 0
        go(game, choice, forged)
        if k >= 200:
            np.testing.assert_allclose(game.state.fed[0], z[k % 16, :4], atol=1e-8)


def test_a_filter_is_not_reached_by_lies_of_sensors_that_it_does_not_use() -> None:
    honest, attacked = (
        started([4], preset="learning", attack_order=(2,), onset_step=220, compromised_weights=(0, 1)) for _ in "ab"
    )
    action = absolute_action(attacked.config, np.full((1, 4), 12.0))
    go(honest, 31, num_steps=260)  # heats by the model alone, so that both days stay alike
    go(attacked, 31, action, num_steps=260)
    member = membership(attacked.config, filter_sets(attacked.config))
    same = (honest.state.filtered[0] == attacked.state.filtered[0]).all(axis=1)
    assert (same == ~member[:, 1]).all()


def test_innovations_of_honest_days_are_white_and_of_the_stated_size() -> None:
    """With the drift that filters expect they are standard normal but for what the steps and the plant add."""
    game = started(range(60), preset="learning", compromised_weights=(1,), model_error=0.0, unmeasured_heat_w=0.0,
                   heat_drift_w=100.0, drift_hold_h=4.0, forecast_bias_c=0.0, forecast_drift_c=0.0)  # fmt: skip
    rows = []
    go(game, 0, num_steps=100)
    for _ in range(300):
        go(game, 0)
        rows.append(game.state.innovation[:, 14].copy())
    r = np.array(rows)
    assert r.std() == pytest.approx(1.0, abs=0.02)
    assert abs((r[1:] * r[:-1]).mean()) < 0.02


def test_a_filter_knows_the_heat_that_the_observer_does_not() -> None:
    game = started(range(40), preset="learning", compromised_weights=(1,))
    go(game, 0, num_steps=240)
    true = game.state.heat + game.state.heat_drift[:, 239]
    believed = game.state.filtered[:, 14, 4:]
    assert np.corrcoef(true.ravel(), believed.ravel())[0, 1] > 0.7
    error = np.abs(game.state.estimate - game.state.temperature[:, np.newaxis]).mean(axis=(0, 2))
    assert error[30] < 0.4 * error[14]  # all sensors by filter, three of four by the moving horizon


def test_the_observation_shows_every_choice() -> None:
    game = started([0], preset="learning")
    go(game, 0, num_steps=210)
    shown = seen(game, "defender")
    np.testing.assert_allclose(shown["estimate"][0], game.state.estimate[0], atol=1e-4)
    np.testing.assert_allclose(shown["innovation"][0], game.state.innovation[0], atol=1e-4)
    np.testing.assert_allclose(seen(game, "attacker")["innovation_mean"][0], game.state.innovation_mean[0], atol=1e-4)
    np.testing.assert_allclose(shown["estimate"][0, 16:], game.state.filtered[0, :, :4], atol=1e-4)


def test_before_the_window_is_full_a_filter_means_the_least_squares() -> None:
    one, other = (started([0], preset="learning") for _ in "ab")
    go(one, 20, num_steps=5)
    go(other, 15, num_steps=5)
    assert (one.state.fed == other.state.fed).all()
    assert one.action_mask("defender")[0].nonzero()[0].tolist() == [0, 15]
    go(one, 20, num_steps=200)
    assert one.action_mask("defender").all()


def test_a_house_can_have_filters_too() -> None:
    game = started([0], kalman_filters=True, **house(9), num_steps=260)
    go(game, 0, num_steps=205)
    go(game, filter_choice(game.config, tuple(range(1, 10))), num_steps=40)
    assert np.abs(game.state.filtered[0, -2, :9] - game.state.temperature[0]).max() < 0.7
    assert len(filter_sets(game.config)) == 9 + 2


def test_copies_go_on_as_the_episode_would() -> None:
    game = started([6, 7], preset="learning")
    go(game, 0, num_steps=230)
    copies = game.model(1, 3)
    action = absolute_action(game.config, np.full((1, 4), 30.0))
    for steps in (1, 40):
        paid, again = go(game, 30, action, num_steps=steps), go(copies, 30, action, num_steps=steps)
        np.testing.assert_array_equal(again, np.full(3, paid[1]))
    for role in ("attacker", "defender"):
        np.testing.assert_array_equal(copies.observe(role), np.repeat(game.observe(role)[1:], 3, axis=0))
    before = game.state.temperature.copy()
    go(copies, 0, action, num_steps=100)
    assert (game.state.temperature == before).all()
    with pytest.raises(Exception, match="cannot advance"):
        go(copies, 0, num_steps=1000)


def test_metrics_count_filters_as_sets() -> None:
    game = started([0], preset="learning", attack_order=(2,), compromised_weights=(0, 1), onset_step=200)
    go(game, 0, num_steps=200)
    for sensors, times in (((1, 2), 3), ((1,), 2), (EMPTY, 4), (FULL, 1)):
        go(game, filter_choice(game.config, sensors), num_steps=times)
    found = game.episode_metrics(0)
    assert (found["distinct_sets"], found["flawed_steps"], found["model_steps"]) == (3, 4, 4)
