"""The attackers and defenders of preset `learning` against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines.hvac.filters import FilterChoices
from baselines.hvac.smoothness import spread_after
from baselines.hvac.stealthy import loss_response
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.lookup import resolve_policy
from cps_envs.core.match import Match
from cps_envs.core.seen import Seen
from cps_envs.hvac.config import LEARNING, PAPER
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import filter_sets
from tests.hvac.games import go, play, started

SETS = filter_sets(LEARNING)
MODEL, FIRST = 15, 16  # choices: the model, and the first filter
SIGNED = ("ramp", "root_ramp", "mimic", "brink", "shaped", "opportunist")


def spec_of(role, preset="learning", **overrides):
    return HvacGame(HVAC.config(preset, overrides), 1).spec(role)


def watched(attacker, defender, seeds, on_step, **overrides):
    """Play with objects, so that `on_step` can look at game and match."""
    game = HvacGame(HVAC.config("learning", overrides), len(seeds))
    match = Match(game, {"attacker": resolve_policy(attacker, game.spec("attacker")),
                         "defender": resolve_policy(defender, game.spec("defender"))})  # fmt: skip
    everybody = np.ones(len(seeds), bool)
    match.reset(everybody, [np.random.default_rng(seed) for seed in seeds])
    for _ in range(game.horizon):
        match.step({}, everybody, 1)
        on_step(game)
    return game


# Attackers


@pytest.mark.parametrize("name", SIGNED)
def test_both_signs_are_mirrored(name):
    """Before the clipping of readings, a warmer attack is above the truth by what a colder one is below it."""
    found = {}
    for sign in ("", "?warmer=true"):
        differences = []

        def note(game, kept=differences):
            true = game.state.temperature[:, game.constants.zone]
            kept.append(np.where(game.state.compromised, game.state.reading - true, 0.0))

        config = {"compromised_weights": (0, 0, 1), "onset_step": 210, "num_steps": 260, "noise_std_c": 1e-9}
        watched(name + sign, "model_only", [3], note, **config)
        found[sign] = np.array(differences)
    assert np.abs(found[""][-1]).max() > 0.1
    assert found[""].min() < -0.1
    assert found[""].max() < 1e-6
    if name in ("ramp", "root_ramp", "mimic", "shaped"):  # the others answer the loop
        np.testing.assert_allclose(found["?warmer=true"], -found[""], atol=1e-6)
    assert found["?warmer=true"].max() > 0.1
    assert found["?warmer=true"].min() > -1e-6


def test_a_warm_mimic_shows_a_gain_of_heat():
    spec = spec_of("attacker")
    colder, warmer = (resolve_policy(f"mimic{sign}", spec) for sign in ("", "?warmer=true"))
    observation = np.zeros((1, spec.fields.size), np.float32)
    at = spec.fields.slices["attack_h"].start
    observation[:, at] = 2 * 3.0 / LEARNING.duration_h - 1  # 3 h after the onset
    shown = [policy.act(Seen(spec.fields, observation), None)[0][0, :4] for policy in (colder, warmer)]
    np.testing.assert_allclose(shown[0], -loss_response(LEARNING, 100.0)[90] / 15.0, rtol=1e-5)
    np.testing.assert_allclose(shown[1], -shown[0])


@settings(max_examples=40, deadline=None)
@given(
    rate=st.floats(0, 20), exponent=st.floats(0.1, 3), cap=st.floats(0, 15), delay=st.floats(0, 10),
    weights=st.lists(st.floats(-1, 1), min_size=4, max_size=4), age_h=st.floats(0, 12), warmer=st.booleans(),
)  # fmt: skip
def test_a_shaped_attack_is_its_formula(rate, exponent, cap, delay, weights, age_h, warmer):
    spec = spec_of("attacker")
    named = {f"w{place + 1}": weight for place, weight in enumerate(weights)}
    policy = resolve_policy("shaped", spec, rate_c_per_h=rate, exponent=exponent, cap_c=cap, delay_h=delay,
                            warmer=warmer, **named)  # fmt: skip
    steps = round(age_h * 30)
    observation = np.zeros((1, spec.fields.size), np.float32)
    observation[:, spec.fields.slices["attack_h"].start] = 2 * (steps / 30) / LEARNING.duration_h - 1
    action = policy.act(Seen(spec.fields, observation), None)[0][0]
    size = min(cap, 10 * rate * (max(steps / 30 - delay, 0) / 10) ** exponent)
    expected = np.array(weights) * size * (1 if warmer else -1) / 15
    np.testing.assert_allclose(action[:4], np.clip(expected, -1, 1), atol=1e-9)
    assert action[4] == -1.0


@pytest.mark.parametrize("options", ["rate_c_per_h=-1", "exponent=0", "cap_c=-1", "delay_h=-1", "w2=1.5"])
def test_shapes_that_cannot_be_are_refused(options):
    with pytest.raises(ConfigurationError, match="weights within"):
        resolve_policy(f"shaped?{options}", spec_of("attacker"))


def test_the_opportunist_lies_boldly_to_whom_it_has_caught():
    config = {"compromised_weights": (0, 1), "onset_step": 215, "num_steps": 400}
    for defender in ("none", "fixed", "mtd1"):
        bold = play("opportunist", defender, range(20), "learning", **config)["return"]
        constant = play("constant?reading_c=10", defender, range(20), "learning", **config)["return"]
        assert bold.mean() > 0.9 * constant.mean(), defender


@pytest.mark.parametrize("defender", ["mtd2", "cusum", "model_only"])
def test_the_opportunist_creeps_past_whom_it_has_not(defender):
    config = {"num_steps": 500}
    careful, brink = (play(name, defender, range(12), "learning", **config) for name in ("opportunist", "brink"))
    np.testing.assert_array_equal(careful["return"], brink["return"])


def test_the_tracker_holds_its_innovations_below_its_level():
    """Against a defender who follows the filter of all sensors, beside noise of its own."""
    rows = []

    def note(game):
        if game.state.step[0] > 260:
            rows.append(np.where(game.state.compromised, game.state.innovation[:, 14], np.nan))

    config = {"compromised_weights": (0, 0, 1), "onset_step": 210, "num_steps": 500}
    for sign, reference in ((-1, "tracker?level=0.5&noise=0"), (1, "tracker?level=0.5&noise=0&warmer=true")):
        rows.clear()
        watched(reference, f"always?action={FIRST + 14}", range(12), note, **config)
        assert 0.3 < sign * np.nanmean(rows) < 0.5  # the prediction follows, so that it stays a little below
        assert np.nanstd(rows) < 0.3  # no noise of its own
    rows.clear()
    watched("tracker?level=0.5", f"always?action={FIRST + 14}", range(12), note, **config)
    assert 0.3 < -np.nanmean(rows) < 0.5
    assert np.nanstd(rows) == pytest.approx(1.0, abs=0.1)


def test_the_tracker_is_not_summed_up_by_a_slack_above_its_level():
    """Only noise and honest sensors raise alarms then; it does more than a ramp that a CUSUM finds out."""
    days = {"compromised_weights": (0, 1), "onset_step": 210}
    tracker, ramp = (play(name, "cusum?kappa=0.5", range(40), "learning", **days)["return"] for name in
                     ("tracker", "ramp?rate_c_per_h=3&keep_noise=true"))  # fmt: skip
    assert tracker.mean() > ramp.mean()


@pytest.mark.parametrize("options", ["level=0", "gain=-1", "cap_c=0", "noise=-0.1"])
def test_trackers_that_cannot_be_are_refused(options):
    with pytest.raises(ConfigurationError, match="positive"):
        resolve_policy(f"tracker?{options}", spec_of("attacker"))


@pytest.mark.parametrize(
    ("preset", "overrides", "remedy"),
    [
        ("learning", {"attacker_view": "grey"}, "white"),
        ("learning", {"attack_action": "bias"}, "any"),
        ("paper", {}, "kalman_filters=true"),
    ],
)
def test_a_tracker_says_what_it_needs(preset, overrides, remedy):
    with pytest.raises(ConfigurationError, match=remedy):
        resolve_policy("tracker", spec_of("attacker", preset, **overrides))


# Defenders


@given(values=st.lists(st.floats(-20, 20), min_size=1, max_size=60))
def test_the_mean_square_stays_between_what_it_averages(values):
    spread = np.ones(1)
    for value in values:
        before, spread = spread, spread_after(spread, np.array([value]))
        square = min(value**2, 9.0)
        assert min(before[0], square) - 1e-12 <= spread[0] <= max(before[0], square) + 1e-12


@pytest.mark.parametrize("name", ["cusum", "largest"])
@pytest.mark.parametrize("attacker", ["brink", "brink?warmer=true", "tracker?noise=0"])
def test_readings_without_noise_are_too_smooth(name, attacker):
    days = {"compromised_weights": (0, 0, 1)}
    tested, blind, told = (play(attacker, policy, range(30), "learning", **days)["return"].mean()
                           for policy in (name, f"{name}?smooth=0", "informed"))  # fmt: skip
    assert tested < 0.7 * blind
    assert tested < told + 3.0


def cusum_of(readings_by_filter, kappa, limit, quiet, release, smooth):
    """The definition in plain Python: the trusted sensors after each step, of r and its mean (F, S) at each."""
    trusted, up, down, calm, found = {0, 1, 2, 3}, [0.0] * 4, [0.0] * 4, [0] * 4, []
    square = [1.0] * 4
    for r, mean in readings_by_filter:
        own = SETS.index(tuple(sorted(s + 1 for s in trusted)))
        for s in range(4):
            up[s] = max(0.0, up[s] + r[own][s] - kappa)
            down[s] = max(0.0, down[s] - r[own][s] - kappa)
            square[s] += (min(r[own][s] ** 2, 9.0) - square[s]) / 30
            calm[s] = 0 if s in trusted or abs(mean[own][s]) > quiet or square[s] < smooth else calm[s] + 1
        worst = max(sorted(trusted), key=lambda s: max(up[s], down[s]), default=None)
        alarm = worst is not None and max(up[worst], down[worst]) > limit
        trusted |= {s for s in range(4) if calm[s] >= release}
        trusted -= {s for s in range(4) if square[s] < smooth}
        if alarm:
            trusted.discard(worst)
            up, down = [0.0] * 4, [0.0] * 4
        for s in range(4):
            if s not in trusted:
                up[s] = down[s] = 0.0
        found.append(tuple(sorted(s + 1 for s in trusted)))
    return found


@pytest.mark.parametrize("attacker", ["constant?reading_c=28", "ramp", "ramp?keep_noise=true", "none"])
def test_cusum_is_its_definition(attacker):
    shown, chosen = [], []

    def note(game):
        fields = game.fields["defender"].decode(game.observe("defender"))
        shown.append((fields["innovation"][0], fields["innovation_mean"][0]))
        chosen.append(int(game.state.choice[0]))

    policy = "cusum?kappa=0.3&limit=6&quiet=0.5&release_h=1&smooth=0.4"
    watched(attacker, policy, [11], note, compromised_weights=(0, 0, 1), num_steps=420, onset_step=230)
    start = np.zeros((16, 4)), np.zeros((16, 4))  # about what it sees at k = 0: nothing is near the limit
    expected = cusum_of([start, *shown[:-1]], 0.3, 6.0, 0.5, 30, 0.4)
    assert len(set(expected)) > 1
    ready = slice(201, None)
    assert [SETS[choice - FIRST] for choice in chosen[ready]] == expected[ready]


def test_largest_takes_the_most_sensors_without_an_alarm():
    policy = resolve_policy("largest?kappa=0.5&limit=3&release_h=1&smooth=0", spec_of("defender"))
    spec, state = policy.spec, policy.begin([None], [{}])
    observation = np.zeros((1, spec.fields.size), np.float32)
    observation[:, spec.fields.slices["ready"]] = 1
    part = spec.fields.slices["innovation"]

    def chosen(innovation, state):
        observation[:, part] = innovation.reshape(-1) / 10
        choices, state = policy.act(Seen(spec.fields, observation), state)
        return SETS[choices[0] - FIRST], state

    nothing, lie = np.zeros((16, 4)), np.zeros((16, 4))
    lie[[2 in sensors for sensors in SETS], 1] = -4.0  # sensor 2 is off wherever it is used
    assert chosen(nothing, state)[0] == (1, 2, 3, 4)
    found, state = chosen(lie, state)
    assert found == (1, 3, 4)
    for _ in range(29):
        found, state = chosen(nothing, state)
        assert found == (1, 3, 4)
    assert chosen(nothing, chosen(nothing, state)[1])[0] == (1, 2, 3, 4)


def test_a_lie_outside_a_filter_does_not_raise_its_alarm():
    policy = resolve_policy("largest?smooth=0", spec_of("defender"))
    spec = policy.spec
    observation = np.zeros((1, spec.fields.size), np.float32)
    observation[:, spec.fields.slices["ready"]] = 1
    innovation = np.zeros((16, 4))
    innovation[SETS.index((1, 3, 4)), 1] = 9.0
    observation[:, spec.fields.slices["innovation"]] = innovation.reshape(-1) / 10
    state = policy.begin([None], [{}])
    for _ in range(10):
        choices, state = policy.act(Seen(spec.fields, observation), state)
    assert SETS[choices[0] - FIRST] == (1, 2, 3, 4)


def test_the_informed_one_believes_all_but_the_liars():
    chosen = []
    game = watched("ramp", "informed", range(8), lambda game: chosen.append(game.state.choice.copy()))
    for b in range(8):
        intact = tuple(s + 1 for s in range(4) if not game.state.compromised[b, s])
        assert {int(choices[b]) for choices in chosen[200:]} == {FIRST + SETS.index(intact)}
        assert {int(choices[b]) for choices in chosen[:200]} == {MODEL}
    assert game.metrics()["flawed_steps"].max() == 0


def test_the_truth_is_the_nearest_estimate():
    before = []

    def note(game):
        if before:
            estimate, true, ready = before[-1]
            nearest = ((estimate - true[:, np.newaxis]) ** 2).sum(axis=2).argmin(axis=1)
            np.testing.assert_array_equal(game.state.choice, nearest if ready else MODEL)
        state = game.state
        before.append((state.estimate.copy(), state.temperature.copy(), state.step[0] >= 200))

    watched("brink", "truth", range(3), note, num_steps=260, onset_step=210)


@pytest.mark.parametrize("name", ["informed", "truth"])
def test_who_is_told_says_so(name):
    policy = resolve_policy(name, spec_of("defender"))
    assert policy.privileged == {"truth"}
    with pytest.raises(TypeError, match="truth"):
        policy.predict(np.zeros((1, policy.spec.fields.size), np.float32))


@pytest.mark.parametrize("name", ["cusum", "largest", "informed"])
def test_without_filters_they_say_what_to_do(name):
    with pytest.raises(ConfigurationError, match="kalman_filters=true"):
        resolve_policy(name, spec_of("defender", "paper"))


@pytest.mark.parametrize("reference", ["cusum?kappa=0", "cusum?smooth=-1", "largest?limit=0", "largest?smooth=-1"])
def test_numbers_that_are_not_positive_are_refused(reference):
    with pytest.raises(ConfigurationError, match="positive"):
        resolve_policy(reference, spec_of("defender"))


def test_filters_are_named_by_the_sensors_that_are_wanted():
    filters = FilterChoices(LEARNING)
    wanted = np.array([[1, 1, 1, 1], [0, 0, 0, 0], [1, 0, 1, 1], [0, 1, 0, 0]], bool)
    assert [SETS[index] for index in filters.index_of(wanted)] == [(1, 2, 3, 4), (), (1, 3, 4), (2,)]
    with pytest.raises(ConfigurationError, match="kalman_filters=true"):
        FilterChoices(PAPER)


@pytest.mark.parametrize("name", ["cusum", "largest"])
def test_honest_days_cost_little_though_heat_comes_in_steps(name):
    """Steps of heat look like lies, so some sensor is distrusted for part of the day; but zones are linked."""
    apart = []

    def note(game):
        if game.state.step[0] > 200:
            apart.append((game.state.choice != FIRST + 14).mean())

    days, honest = range(700, 760), {"compromised_weights": (1,)}
    paid = watched("none", name, days, note, **honest).metrics()["a_impact"]
    everything = play("none", f"always?action={FIRST + 14}", days, "learning", **honest)["return"]
    assert 0.02 < np.mean(apart) < 0.6
    assert (paid - everything).mean() < 2.0


def test_truth_of_a_game_changes_with_it():
    game = started([0, 1], preset="learning")
    told = game.truth(1)
    before = told["temperature"].copy()
    go(game, 0, num_steps=20)
    assert (told["temperature"] != before).all()
    np.testing.assert_array_equal(told["compromised"], game.state.compromised[1])
