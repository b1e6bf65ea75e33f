"""The defenders that watch filters, against their definitions: whom they find, and that they are quiet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from cps_baselines.fdi.bank import Bank, honest_sets
from cps_baselines.fdi.disturbance_filter import DRIFT_MPS2, hypothesis_filters
from cps_baselines.fdi.hypotheses import Hypotheses
from cps_baselines.fdi.innovation_tests import Chi2, Cusum, add_up
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import Array
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.problem import FDI
from tests.episodes import observed
from tests.fdi.episodes import QUIET, Filter, place, play, spec_of, started, watched

SPEC = spec_of("defender", preset="learning")
HONEST = {"preset": "learning", "attack_share": 0.0}
LOOSE = 1e6  # deviations: nothing is an outlier


def normalised(innovations: Array, deviation: float = 1.0, **fields: Any) -> Array:
    """An observation (1, size) with normalised innovations (14,)."""
    ranges, rates = np.split(np.multiply(innovations, deviation), 2)
    deviations = dict.fromkeys(("range_deviation", "rate_deviation"), np.full(7, deviation))
    return observed(SPEC, range_innovation=ranges, rate_innovation=rates, steps_left=[100], **deviations, **fields)


def distrust(defender: Chi2 | Cusum, course: Array) -> Array:
    """Doubted readings (steps, 14) while the innovations (steps, 14) are shown."""
    state, doubted = defender.begin(np.random.default_rng(0).spawn(1), [{}]), []
    for values in course:
        actions, state = defender.predict(normalised(values), state)
        assert actions[0, 14:].tolist() == [4] * 4
        doubted.append(actions[0, :14] == 0)
    return np.array(doubted)


def distrusted(game: FdiGame) -> Array:
    """Readings (B, 14) that the defender does not believe."""
    return game.state.trust == 0


@pytest.mark.parametrize("gate", [0.001, 0.01, 0.1])
def test_chi2_doubts_what_a_chi_squared_test_rejects(gate: float) -> None:
    values = np.random.default_rng(0).normal(0, 2, (50, 14))
    expected = values**2 > stats.chi2.ppf(1 - gate, df=1)
    near = np.abs(values**2 - stats.chi2.ppf(1 - gate, df=1)) < 1e-3
    assert np.array_equal(distrust(Chi2(SPEC, gate=gate), values) | near, expected | near)
    assert expected.any()


def slow_sums(course: list[float], drift: float, threshold: float, release: int) -> list[bool]:
    """Page's sums of one sensor, spelled out."""
    above = below = left = 0.0
    found = []
    for value in course:
        above, below, left = max(0.0, above + value - drift), max(0.0, below - value - drift), max(left - 1, 0)
        if above > threshold or below > threshold:
            left = release
        if left > 0:
            above = below = 0.0
        found.append(left > 0)
    return found


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=60), st.floats(0, 1), st.floats(0.5, 6), st.integers(0, 12))
@settings(max_examples=150, deadline=None)
def test_sums_are_those_of_page_and_their_alarms_end(course: Any, drift: float, threshold: float, release: int) -> None:
    sums = np.zeros(3)
    found = [add_up(sums, value, drift, threshold, release) for value in course]
    assert found == slow_sums(course, drift, threshold, release)


def test_cusum_doubts_a_radar_whose_innovations_add_up_for_two_seconds() -> None:
    course = np.zeros((80, 14))
    course[:20, place("v4")] = 1.2
    course[:30, place("x2")] = -1.2
    doubted = distrust(Cusum(SPEC), course)
    expected = np.zeros((80, 14), np.bool_)
    expected[11:31, [place("x4"), place("v4")]] = True  # 12 times 0.9 exceed 10
    expected[15:35, [place("x2"), place("v2")]] = True  # 16 times 0.9 exceed 14
    assert np.array_equal(doubted, expected)


def test_cusum_doubts_outliers_for_a_step() -> None:
    course = np.zeros((5, 14))
    course[2, 3] = 4.0
    doubted = distrust(Cusum(SPEC), course)
    assert np.argwhere(doubted).tolist() == [[2, 3]]


def test_the_bank_has_a_filter_for_each_group_of_sensors_of_one_gap() -> None:
    sets = honest_sets(SPEC.config)
    assert len({tuple(marks) for marks in sets.tolist()}) == len(sets) == 1 + 3 * 15 + 3
    assert sets[0].all()
    assert (np.diff(sets.sum(axis=1)) <= 0).all()
    gaps = np.array([0, 1, 2, 3, 0, 1, 2] * 2)
    assert all(len(set(gaps[~marks])) <= 1 for marks in sets)


@pytest.mark.parametrize("task", ["v4>4", "xv4>4", "xv1+rv2>1", "x2>2", "rxv3>2"])
def test_the_bank_finds_the_liars_where_lies_are_gross(task: str) -> None:
    settings = {**QUIET, "range_noise_m": 0.25, "rate_noise_mps": 0.1, "tasks": task}
    doubted = watched(distrusted, "always?action=40", "bank", range(20), "learning", **settings)
    liars = FDI.config("learning", settings).listed_tasks[0].sensors.flags(4, rear=True)
    late = np.array(doubted[20:])
    assert late[..., liars].mean() > 0.99
    assert late[..., ~liars].mean() < 0.05


def test_the_first_filter_of_the_bank_is_that_of_the_game() -> None:
    """Where nothing is doubted, its estimates are what the game's next predictions begin with."""
    spec = spec_of("defender", preset="learning")
    bank = Bank(spec, gate=1e-12, threshold=1e9, rate_threshold=1e9)
    state = bank.begin(np.random.default_rng(0).spawn(8), [{}] * 8)
    predictions, estimates = [], []

    def look(game: FdiGame) -> None:
        nonlocal state
        predictions.append(game.state.prediction.copy())
        _, state = bank.predict(game.observe("defender"), state)
        estimates.append(state[0][:, 0].copy())

    config = FDI.config("learning", {"attack_share": 0.0})
    play_episodes(FDI, config, {}, range(8), on_step=look)
    for estimate, prediction in zip(estimates[:50], predictions[1:], strict=False):
        added = prediction[:, 4:] - estimate[:, 4:]  # by the commands
        np.testing.assert_allclose(prediction[:, :4], estimate[:, :4] + 0.1 * estimate[:, 4:] + 0.05 * added, atol=1e-4)


def test_informed_replaces_what_is_attacked_from_the_onset_on() -> None:
    found = watched(
        lambda game: (game, distrusted(game)),
        "none",
        "informed",
        range(30),
        "learning",
        tasks="xv1+rv2>1 v4>4",
        attack_share=0.5,
    )
    game, doubted, steps = found[-1][0], [marks for _, marks in found], np.arange(len(found) - 1)
    for b in range(30):
        truth = game.truth(b)
        expected = truth["attacked"][np.newaxis] & (steps >= truth["onset"])[:, np.newaxis]
        over = game.state.step[b]
        assert np.array_equal(np.array(doubted)[1 : over + 1, b], expected[:over])
    assert {game.truth(b)["onset"] == 100 for b in range(30)} == {True, False}


@pytest.mark.parametrize("defender", ["chi2", "cusum", "bank"])
def test_hardly_any_alarm_and_no_collision_without_attack(defender: str) -> None:
    outcome = play("none", defender, seeds=range(9000, 9300), **HONEST)
    assert outcome["collided_pairs"].max() == 0
    assert outcome["smallest_gap_m"].min() > 2
    assert outcome["false_alarm"].mean() < 0.12


class JointFilter:
    """The filter with disturbances as in textbooks: all readings at once, by the inverse of their covariance."""

    KEPT = 0.9  # of a disturbance that lasts 10 steps, in each

    def __init__(self, heard: np.ndarray, drift_mps2: float = 0.0) -> None:
        plain = Filter(started())
        n = plain.n
        self.heard, self.r, self.command = heard, plain.r, plain.b
        self.h = np.hstack([plain.h, np.zeros((len(plain.h), n + 1))])
        self.a = np.eye(3 * n + 1)
        self.a[: 2 * n] = np.hstack([plain.a, plain.b, plain.b.sum(axis=1, keepdims=True)])
        self.a[2 * n : 3 * n, 2 * n : 3 * n] *= self.KEPT
        self.x = np.zeros(3 * n + 1)
        square = (0.3**2 + 0.3 * 0.5 + 0.5**2) / 3  # mean square of deviations from 0.3 to 0.5 m/s2
        self.p = np.diag([*np.diag(plain.p), *np.full(n, square), drift_mps2**2])
        self.q = np.diag([*np.zeros(2 * n), *np.full(n, (1 - self.KEPT**2) * square), 0.0])

    def take(self, reading: np.ndarray) -> None:
        """The estimate of now."""
        h, r = self.h[self.heard], self.r[np.ix_(self.heard, self.heard)]
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        self.x = self.x + gain @ (reading[self.heard] - h @ self.x)
        self.p = self.p - gain @ h @ self.p

    def go_on(self, command: np.ndarray) -> None:
        """The prediction of this step."""
        self.x, self.p = self.a @ self.x, self.a @ self.p @ self.a.T + self.q
        self.x[: 2 * len(command)] += self.command @ command


@pytest.mark.parametrize("hypothesis", [0, 1, 20, -1])
def test_every_filter_is_that_of_textbooks(hypothesis: Any) -> None:
    known, defender = hypothesis_filters(SPEC.config), Hypotheses(SPEC, outlier=LOOSE)
    joint = JointFilter(known.heard[hypothesis], DRIFT_MPS2 if hypothesis == -1 else 0.0)
    state = defender.begin([np.random.default_rng(0)], [{}])

    def look(game: Any) -> None:
        nonlocal state
        if game.elapsed[0] < 25:
            if game.elapsed[0] > 0:
                joint.go_on(game.state.command[0])
            joint.take(game.state.reading[0])
            _, state = defender.predict(game.observe("defender"), state)
            np.testing.assert_allclose(state[0][0, :, hypothesis], joint.x, atol=1e-4)

    play_episodes(FDI, SPEC.config, {"attacker": "tracker", "defender": "bank"}, [3], on_step=look)


def test_a_wrong_belief_costs_the_first_filter_nothing() -> None:
    surprise = hypothesis_filters(SPEC.config).surprise
    assert np.all(surprise[:, 0] == 0)
    assert surprise[1:].min() > -1e-9  # who hears less expects wider innovations


@pytest.mark.parametrize("task", FDI.config("learning", {}).tasks.split())
def test_loud_lies_are_found_and_do_hardly_any_harm(task: Any) -> None:
    settings = {"preset": "learning", "tasks": task, "attack_share": 1.0, "seeds": range(20)}
    outcome = play("swing", Hypotheses(SPEC), **settings)
    assert outcome["detected"].min() == 1
    most = 0.2 if task == "xv4>4" else 0.1  # the lead drives blindly then, and may collide slowly
    assert outcome["impact_speed_mps"].mean() <= most


def test_quiet_lies_do_less_harm_than_against_the_bank() -> None:
    settings = {"preset": "learning", "attack_share": 1.0, "seeds": range(60)}
    found, bank = (play("tracker", defender, **settings)["impact_speed_mps"] for defender in (Hypotheses(SPEC), "bank"))
    assert found.mean() < 0.5 * bank.mean()


def test_it_is_quiet_where_nobody_attacks() -> None:
    outcome = play("none", Hypotheses(SPEC), preset="learning", seeds=range(200))
    assert outcome["false_alarm"].mean() < 0.1
    assert outcome["collided_pairs"].max() == 0


def test_nobody_has_to_know_how_long_disturbances_last() -> None:
    outcomes = [
        play("none", Hypotheses(SPEC), preset="learning", seeds=range(100), disturbance_hold_s=hold_s)
        for hold_s in (0.7, 1.3)
    ]
    assert max(outcome["false_alarm"].mean() for outcome in outcomes) < 0.1


def test_a_vehicle_brakes_that_nobody_can_check() -> None:
    shown = observed(SPEC, steps_left=[100], range_error=[0, 0, 0, 9.0], range_rate=[0, 0, 0, 9.0])
    defender = Hypotheses(SPEC, threshold=1.0, per_sensor=0.1, correction=0.0, caution=1.0)
    actions, _ = defender.predict(shown, defender.begin([np.random.default_rng(0)], [{}]))
    assert actions[0, [place("x4"), place("v4")]].tolist() == [0, 0]
    assert actions[0, 14:].tolist() == [4, 4, 4, 2]  # 1 m/s2 in steps of 0.5
