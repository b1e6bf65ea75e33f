"""Kalman filters of sets of sensors, and the defender that weighs sets of liars by Bayes' rule."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from cps_baselines.hvac.bayes import MOST_SQUARED, Bayes, choose
from cps_baselines.hvac.hypotheses import BIAS_KEPT, START, hypotheses, liar_sets
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.building import discretise
from cps_envs.hvac.config import LEARNING, PAPER, HvacConfig
from cps_envs.hvac.houses import house
from cps_envs.hvac.kalman import filter_gains, memory
from cps_envs.hvac.model import build_model
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import filter_sets, membership, sensor_sets, zones_of_sensors
from tests.episodes import noted
from tests.hvac.games import go, play, seen, spec_of, started, watched

FULL, EMPTY = (1, 2, 3, 4), ()
KINDS = 3  # slow, bold and still liars


def augmented(config: HvacConfig) -> tuple[Array, ...]:
    """F, B, G (8, 8 or 4), Q of temperatures and heats, written from the text of `kalman`."""
    building, phi = discretise(config), memory(config)
    F = np.zeros((8, 8))
    F[:4, :4], F[:4, 4:], F[4:, 4:] = building.A, np.diag(building.B), phi * np.eye(4)
    Q = np.zeros((8, 8))
    Q[4:, 4:] = (1 - phi**2) * config.filter_heat_w**2 * np.eye(4)
    return F, building.B, building.G, Q


def filter_choice(config: HvacConfig, sensors: tuple[int, ...]) -> int:
    """The choice that feeds the estimate of the filter with these sensors to the controller."""
    return len(sensor_sets(config)) + 2 + filter_sets(config).index(sensors)


def test_every_set_all_and_none_are_offered() -> None:
    sets = sensor_sets(LEARNING)
    assert filter_sets(LEARNING) == (*sets, FULL, EMPTY)
    assert filter_sets(PAPER) == ()
    assert [filter_choice(LEARNING, sensors) for sensors in (sets[0], FULL, EMPTY)] == [16, 30, 31]
    assert HVAC.game(LEARNING, 1).action_space["defender"].n == 32


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


def test_metrics_count_filters_as_sets() -> None:
    game = started([0], preset="learning", attack_order=(2,), compromised_weights=(0, 1), onset_step=200)
    go(game, 0, num_steps=200)
    for sensors, times in (((1, 2), 3), ((1,), 2), (EMPTY, 4), (FULL, 1)):
        go(game, filter_choice(game.config, sensors), num_steps=times)
    found = game.episode_metrics(0)
    assert (found["distinct_sets"], found["flawed_steps"], found["model_steps"]) == (3, 4, 4)


def noting(policy: Any) -> list[Any]:
    """What it saw of the first day at each decision, and its state after it."""
    return noted(
        policy,
        lambda seen, choice, state: (
            seen["heating"][0].copy(),
            seen["reading"][0].copy(),
            *(part[0].copy() for part in state),
        ),
    )


def remembered(attacker: Any, seed: Any, beliefs: Any = START, **overrides: Any) -> Any:
    policy = Bayes(spec_of("defender", **overrides), beliefs=(beliefs,))
    notes = noting(policy)
    play(attacker, policy, [seed], "learning", **overrides)
    return notes


def by_definition(notes: Any, beliefs: Any) -> Any:
    """The estimates (H, 16) and weights (H,) after the last note, in plain NumPy."""
    model, t, phi = build_model(LEARNING), hypotheses(LEARNING, beliefs), memory(LEARNING)
    z, w = np.zeros((len(t.prior), 16)), np.zeros(len(t.prior))
    z[:, :4], w[0] = LEARNING.initial_c, 1.0
    for k, (heating, reading, *_) in enumerate(notes):
        coming = w[0] * t.onset * t.prior
        share = np.divide(coming, w + coming, out=np.zeros_like(w), where=coming > 0)[:, np.newaxis]
        z, w = z + share * (z[0] - z), np.where(t.prior > 0, w + coming, w * (1 - t.onset))
        for first in range(1, len(w), KINDS):
            kinds = slice(first, first + KINDS)
            turned = t.change * np.outer(t.kinds, w[kinds]) + (1 - t.change) * np.diag(w[kinds])
            z[kinds], w[kinds] = turned @ z[kinds] / turned.sum(axis=1, keepdims=True), turned.sum(axis=1)
        if k > 0:
            x = z[:, :4] @ model.A.T + model.B * (heating + z[:, 4:8]) + model.G * model.weather[k - 1]
            z = np.hstack([x, phi * z[:, 4:8], BIAS_KEPT * z[:, 8:12] + z[:, 12:], t.growth_kept * z[:, 12:]])
        innovation = reading - z[:, :4] - z[:, 8:12] * t.lies
        squared = (np.einsum("hij,hj->hi", t.whiten, innovation) ** 2).sum(axis=1)
        w = w * np.exp(t.trust * (t.offset - 0.5 * np.minimum(squared, MOST_SQUARED)))
        z, w = z + np.einsum("hij,hj->hi", t.gain, innovation), w / w.sum()
    return z, w


@pytest.mark.parametrize(("attacker", "together"), [("tracker", 0.7), ("constant", 0.0)])
def test_weights_and_estimates_are_their_definition(attacker: Any, together: Any) -> None:
    beliefs = START._replace(trust=0.8, onset_per_h=2.0, together=together)
    days = {"num_steps": 120, "window_steps": 40, "onset_step": 60, "compromised_weights": (0, 0, 1)}
    notes = [(h, y, z, w) for h, y, z, w, _ in remembered(attacker, 3, beliefs, **days)]
    z, w = by_definition([note[:2] for note in notes], beliefs)
    weights = np.exp(notes[-1][3])
    np.testing.assert_allclose(weights / weights.sum(), w, atol=1e-6)
    np.testing.assert_allclose(notes[-1][2][:, :4], z[:, :4], atol=1e-5)


def test_without_an_attack_the_first_hypothesis_is_the_filter_of_all_sensors() -> None:
    short = {"onset_step": 250, "num_steps": 300}
    beliefs = START._replace(heat_w=LEARNING.filter_heat_w)
    policy = Bayes(spec_of("defender", **short), beliefs=(beliefs,))
    notes = noting(policy)
    shown = watched(lambda game: game.state.filtered[0, 14].copy(), "none", policy, [5], **short)
    for (_, _, z, *_), filtered in zip(notes[1:], shown[1:], strict=False):
        np.testing.assert_allclose(z[0, :8], filtered, atol=1e-3)


@pytest.mark.parametrize(
    ("attacker", "most"),
    [
        ("constant?reading_c=15", 0.1),
        ("ramp?rate_c_per_h=3&keep_noise=true", 1.0),  # who may lie smoothly may also lie by next to nothing
    ],
)
def test_it_finds_who_lies(attacker: Any, most: Any) -> None:
    lies = liar_sets(LEARNING)
    for liars in (1, 2, 3):
        days = {"compromised_weights": (), "num_compromised": liars, "random_compromise": False, "onset_step": 300}
        _, _, _, weights, _ = remembered(attacker, 2, **days)[520]
        probability = np.exp(weights) / np.exp(weights).sum()
        who = np.repeat(lies, [1] + [KINDS] * (len(lies) - 1), axis=0)
        assert (probability @ who)[[1, 0, 3][:liars]].min() > 0.9
        assert (probability @ who)[[1, 0, 3, 2][liars:]].max() <= most


def test_one_liar_tells_of_those_who_drift_with_him() -> None:
    apart, together = (hypotheses(LEARNING, START._replace(together=each)) for each in (0.0, 0.8))
    alone = together.lies.sum(axis=1) <= 1
    np.testing.assert_array_equal(apart.gain[alone], together.gain[alone])
    pairs = together.lies[:, :, np.newaxis] * together.lies[:, np.newaxis] * (1 - np.eye(4))
    taught = [(tables.gain[:, 12:] * pairs).sum(axis=(1, 2)) for tables in (apart, together)]
    slow = np.flatnonzero(together.lies.sum(axis=1) == 3)[::KINDS]
    assert (taught[1][slow] > taught[0][slow]).all()


def test_three_liars_who_drift_together_are_likelier_than_apart() -> None:
    days = {"compromised_weights": (), "num_compromised": 3, "random_compromise": False, "onset_step": 300}
    who = np.repeat(liar_sets(LEARNING), [1] + [KINDS] * (len(liar_sets(LEARNING)) - 1), axis=0)
    all_three, found = (who == np.array([True, True, False, True])).all(axis=1), []
    for together in (0.0, 0.8):
        beliefs = START._replace(together=together)
        played = [remembered("ramp?rate_c_per_h=0.7&keep_noise=true", day, beliefs, **days) for day in range(4)]
        weights = [np.exp(notes[480][3]) for notes in played]
        found.append(np.mean([each[all_three].sum() / each.sum() for each in weights]))
    assert found[1] > found[0] + 0.1


@pytest.mark.parametrize("too_cold", [1.0, 5.0])
def test_the_choice_has_the_least_expected_error(too_cold: Any) -> None:
    generator = np.random.default_rng(0)
    offered, z = generator.normal(25, 1, (7, 31, 4)), generator.normal(25, 1, (7, 6, 16))
    weights, choice = -generator.random((7, 6)), np.zeros(7, np.int64)
    choose(offered, z, weights, np.full(7, too_cold), choice)
    error = offered[:, :, np.newaxis] - z[:, np.newaxis, :, :4]
    cost = (np.where(error < 0, too_cold, 1.0) * error**2).sum(axis=3)
    np.testing.assert_array_equal(choice, np.einsum("bah,bh->ba", cost, np.exp(weights)).argmin(axis=1))


def test_wrong_beliefs_and_configurations_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="have to be positive"):
        Bayes(spec_of("defender"), beliefs=(START._replace(trust=0.0),))
    for together in (-0.1, 1.0):
        with pytest.raises(ConfigurationError, match="at least 0 and below 1"):
            Bayes(spec_of("defender"), beliefs=(START._replace(together=together),))
    with pytest.raises(ConfigurationError, match="kalman_filters=true"):
        Bayes(spec_of("defender", preset="paper"))
    assert not PAPER.kalman_filters


def test_it_pays_less_than_largest_to_those_who_hide() -> None:
    days = {"compromised_weights": (0, 0, 1, 1)}
    weighed, largest = (
        play("tracker", policy, range(24), "learning", **days)["return"].mean()
        for policy in (Bayes(spec_of("defender")), "largest")
    )
    assert weighed < 0.8 * largest
