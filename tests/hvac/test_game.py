"""The game on the kernels: golden values, moves and their timing, payoff, draws, and what the roles observe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.compute.kernels import view
from cps_envs.core.declare.config import bounds
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import ROLES, Array, Role
from cps_envs.hvac.attack import absolute_action, bias_action
from cps_envs.hvac.config import PRESETS
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.observation import BY_CHOICE, mark_better_half, observe_attacker, observe_defender
from cps_envs.hvac.sensors import attack_order, sensor_sets
from cps_envs.hvac.start import start
from tests.hvac.games import QUIET, SHORT, go, play, seen, started

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
MODEL = 15  # the last choice with four sensors
CONSTANT = "tests.hvac.players:Constant"
READS_22 = np.array([-0.2, -0.2, -0.2, -0.2, 1.0])


def test_noise_free_without_attack_is_as_printed_in_the_specification() -> None:
    game = started(**QUIET)
    visited = {0: game.state.temperature[0].copy()}
    for k in range(1, 720):
        go(game)
        visited[k] = game.state.temperature[0].copy()
        if k == 3:
            assert game.state.heating[0].tolist() == [10, 0, 10, 0]  # u(2)
    assert visited[1] == pytest.approx([23.999725, 23.999189, 23.997143, 23.998545], abs=0.5e-6)
    assert visited[200] == pytest.approx([25.433427, 25.215844, 25.953721, 25.737094], abs=0.5e-6)
    assert visited[719] == pytest.approx([25.027763, 24.981872, 25.132074, 25.138498], abs=0.51e-6)
    assert game.metrics()["a_impact"][0] == pytest.approx(1.133219, abs=0.5e-6)


def test_noise_free_with_sensor_1_at_22_is_as_printed_in_the_specification() -> None:
    game = started(**QUIET, attack_order=(1,), num_compromised=1)
    strongest = 0.0
    for _ in range(719):
        go(game, attack=READS_22)
        strongest = max(strongest, game.state.heating[0, 0])
    assert game.metrics()["a_impact"][0] == pytest.approx(134.8255, abs=0.5e-4)
    assert game.state.temperature[0] == pytest.approx([36.2275, 32.5967, 33.9670, 31.3154], abs=0.5e-4)
    assert strongest == pytest.approx(590)


@pytest.mark.parametrize(
    ("sensors", "expected", "tolerance"),
    [(4, [173, 842, 2675, 8641], 0.02), (8, [9.8, 18, 31, 45, 432, 1821, 4062, 8425], 0.05)],
)
def test_the_constant_attack_hurts_as_in_the_specification(
    sensors: int, expected: Sequence[float], tolerance: float
) -> None:
    """Nobody defends; what defences leave of it is in `test_impacts`."""
    for size, impact in enumerate(expected, 1):
        outcome = play(CONSTANT, "tests.hvac.players:Always", num_compromised=size, num_sensors=sensors)
        assert outcome["a_impact"].mean() == pytest.approx(impact, rel=tolerance), size


def test_eight_sensors_resist_with_one_intact() -> None:
    outcome = play(CONSTANT, "tests.hvac.players:MovingTarget", range(4), num_compromised=7, num_sensors=8)
    assert outcome["a_impact"].mean() == pytest.approx(1.2, rel=0.05)


@pytest.mark.parametrize(("choice", "sensors", "expected"), [(0, 4, 9.5), (0, 8, 5.0), (15, 4, 1.17)])
def test_without_attack_noise_alone_costs_what_the_specification_says(
    choice: int, sensors: int, expected: float
) -> None:
    outcome = play("none", f"tests.hvac.players:Always?choice={choice}", num_sensors=sensors)
    assert outcome["a_impact"].mean() == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("sensors", [4, 8])
def test_every_set_finds_the_state_without_noise(sensors: int) -> None:
    game = started(**QUIET, num_sensors=sensors)
    go(game, num_steps=250)
    assert np.abs(game.state.estimate - game.state.temperature[:, np.newaxis]).max() < 1e-8
    assert game.state.residual.max() < 1e-16


def test_estimates_are_those_of_a_kalman_filter_without_process_noise() -> None:
    """Started N_e samples back with P0 = 1e10: the same least squares without matrices of a window."""
    game = started([3], num_steps=260)
    log = []
    for _ in range(250):
        log.append((game.state.reading[0].copy(), game.state.forced[0].copy()))
        go(game, MODEL)
    A, window = game.constants.A, game.config.window_steps
    for a, sensors in enumerate(sensor_sets(game.config), 1):
        z, P = 25.0 - log[250 - window][1], 1e10 * np.eye(4)
        for reading, forced in log[250 - window :]:
            for s in sensors:
                gain = P[:, s - 1] / (P[s - 1, s - 1] + 1)
                z, P = z + gain * (reading[s - 1] - forced[s - 1] - z[s - 1]), P - np.outer(gain, P[s - 1])
            z, P = A @ z, A @ P @ A.T
        assert game.state.estimate[0, a] - game.state.forced[0] == pytest.approx(z, abs=1e-4)


def test_actions_forge_the_next_readings_and_only_from_the_onset_on() -> None:
    game = started(**SHORT, num_compromised=2)
    for k in range(60):
        forged = game.state.reading[0] != game.state.measured[0]
        assert forged.tolist() == ([True, True, False, False] if k >= 45 else [False] * 4)
        if k >= 45:
            assert game.state.reading[0, :2] == pytest.approx([22, 22])
        go(game, attack=READS_22)


def test_readings_of_the_start_are_never_forged() -> None:
    game = started(**SHORT | {"onset_step": 0})
    assert (game.state.reading == game.state.measured).all()


def test_the_three_bases_of_forged_readings() -> None:
    game = started(**SHORT | {"onset_step": 0}, num_compromised=4)
    shares = np.array([0.1, -0.1, 0.0, 1.0])
    bases = {-1.0: "temperature", -0.4: "temperature", 0.0: "measured", 0.3: "measured", 0.4: None}
    for base, around in bases.items():
        go(game, attack=[*shares, base])
        origin = np.full(4, 25.0) if around is None else getattr(game.state, around)[0]
        assert game.state.reading[0] == pytest.approx(np.minimum(origin + 15 * shares, 40))


def test_actions_in_units() -> None:
    game = started(**SHORT | {"onset_step": 0}, num_compromised=4)
    wanted = np.array([[12.0, 18.0, 25.0, 40.0]])
    go(game, attack=absolute_action(game.config, wanted))
    assert game.state.reading == pytest.approx(wanted)
    go(game, attack=bias_action(game.config, wanted / 10))
    assert game.state.reading == pytest.approx(game.state.temperature - wanted / 10)
    go(game, attack=bias_action(game.config, wanted / 10, keep_noise=True))
    assert game.state.reading == pytest.approx(game.state.measured - wanted / 10)
    with pytest.raises(ConfigurationError, match="sensor_low_c"):
        absolute_action(game.config, wanted - 3)


def test_the_simple_form_of_the_attack_adds_to_own_readings() -> None:
    game = started(**SHORT | {"onset_step": 0}, num_compromised=4, attack_action="bias")
    assert game.action_space["attacker"].shape == (4,)
    go(game, attack=bias_action(game.config, np.full((1, 4), 3.0), keep_noise=True))
    assert game.state.reading == pytest.approx(game.state.measured - 3)
    with pytest.raises(ConfigurationError, match='attack_action="any"'):
        bias_action(game.config, np.full((1, 4), 3.0))


def test_choices_before_the_window_is_full_are_recursive_least_squares() -> None:
    first, second = started(**SHORT), started(**SHORT)
    for _ in range(40):
        assert np.flatnonzero(first.action_mask("defender")[0]).tolist() == [0, MODEL]
        assert np.array_equal(first.episode_mask("defender", 0), first.action_mask("defender")[0])
        go(first, MODEL)
        go(second, 5)
        assert (first.state.fed == second.state.fed).all()
    assert first.action_mask("defender").all()
    assert first.episode_mask("defender", 0).all()
    assert first.action_mask("attacker") is first.episode_mask("attacker", 0) is None


def test_a_change_of_the_chosen_set_is_no_kick() -> None:
    game = started(**SHORT)
    go(game, MODEL, num_steps=50)
    before = game.state.estimate[0, 3].copy()
    go(game, 7)
    now, integrator = game.state.estimate[0, 3].copy(), game.state.integrator[0].copy()
    k, gains = game.state.step[0], game.constants
    go(game, 3)
    du = gains.error_gain @ (25 - now) - gains.difference_gain @ (now - before) - gains.feedforward[k]
    assert game.state.integrator[0] == pytest.approx(np.clip(integrator + du, 0, 1000))


def test_heating_is_rounded_but_not_its_integrator() -> None:
    game = started(**SHORT)
    fractions = []
    for _ in range(89):
        go(game, MODEL)
        assert game.state.heating[0] / 10 == pytest.approx(np.round(game.state.heating[0] / 10), abs=1e-12)
        assert np.abs(game.state.heating - game.state.integrator).max() <= 5 + 1e-9
        fractions.append(game.state.integrator[0] % 10)
    assert np.std(fractions) > 1


@given(
    seed=st.integers(0, 2**32 - 1),
    onset=st.integers(0, 89),
    eight=st.booleans(),
    base=st.sampled_from([-1.0, 0.0, 1.0]),
)
@settings(max_examples=40)
def test_whatever_happens_the_return_is_the_impact_and_the_building_stays_physical(
    seed: int, onset: int, eight: bool, base: float
) -> None:
    game = started(
        [seed, seed + 1], "easy", **SHORT | {"onset_step": onset}, num_sensors=8 if eight else 4, model_error=0.05
    )
    generator = np.random.default_rng(seed)
    entries, choices = game.action_space["attacker"].shape[0], int(game.action_space["defender"].n)
    states, paid = [game.state.temperature.copy()], [np.zeros(2)]
    while game.elapsed[0] < game.horizon:
        attack = generator.uniform(-1, 1, (2, entries))
        attack[:, -1] = base
        actions = {"attacker": attack, "defender": generator.integers(choices, size=2)}
        paid.append(game.advance(actions, np.ones(2, bool), 1))
        states.append(game.state.temperature.copy())
        assert ((game.state.heating >= 0) & (game.state.heating <= 1000)).all()
        assert np.isfinite(game.state.estimate).all()
        for role in ("attacker", "defender"):
            assert np.abs(game.observe(role)).max() <= 1
    impact = ((np.array(states)[onset:] - 25) ** 2).sum(axis=2).mean(axis=0)
    assert game.metrics()["a_impact"] == pytest.approx(impact, rel=1e-9)
    for b in range(2):
        assert math.fsum(payoff[b] for payoff in paid) == pytest.approx(impact[b], rel=1e-9)


def test_noise_does_not_depend_on_what_anybody_does_or_on_the_attack() -> None:
    one, other = started([5]), started([5], num_compromised=4, onset_step=(10, 500), model_error=0.02)
    assert (one.state.measured == other.state.measured).all()
    assert (one.state.series[:, 1:] == other.state.series[:, 1:]).all()  # noise to come
    assert np.abs(one.state.series[:, 1:].std() - 1) < 0.05


def test_learning_draws_within_its_ranges() -> None:
    game = started(range(400), "easy")
    assert game.state.onset.min() >= 100
    assert game.state.onset.max() <= 400
    assert np.ptp(game.state.onset) > 250
    sizes = game.state.compromised.sum(axis=1)
    assert set(sizes) == {1, 2, 3}
    assert game.state.compromised.mean(axis=0) == pytest.approx(np.full(4, 0.5), abs=0.1)


@pytest.mark.parametrize("preset", ["paper", "easy", "learning"])
def test_an_episode_is_drawn_from_its_own_generator_in_one_order(preset: str) -> None:
    """Noise, onset, how many sensors fall and which, plant, heat; disturbances follow."""
    game = started(range(8), preset, **SHORT | {"onset_step": (45, 47)})
    state, c, order = game.state, game.config, np.array(attack_order(game.config)) - 1
    rate, ends = game.constants.rate, np.cumsum(c.compromised_weights)
    for b in range(8):
        own = np.random.default_rng(b)
        np.testing.assert_array_equal(state.series[b, 1:], own.standard_normal(state.series[b].shape)[1:])
        assert state.onset[b] == state.metrics["onset_step"][b] == own.integers(45, 48)
        if len(ends):
            size = int((ends <= ends[-1] * own.random()).sum())
        else:
            size = int(own.integers(bounds(c.num_compromised)[0], bounds(c.num_compromised)[1] + 1))
        places = own.permutation(c.num_sensors)
        fallen = order[places if c.random_compromise else slice(None)][:size]
        assert set(np.flatnonzero(state.compromised[b])) == set(fallen)
        assert state.metrics["num_compromised"][b] == size
        factor = 1 + c.model_error * own.uniform(-1, 1, (4, 4))
        np.testing.assert_allclose(state.plant[b], np.eye(4) + rate * factor, rtol=1e-12)
        np.testing.assert_allclose(state.heat[b], c.unmeasured_heat_w * own.uniform(-1, 1, 4), atol=1e-12)
    assert np.ptp(state.onset) == 2
    assert np.ptp(state.compromised.sum(axis=1)) == {"paper": 0, "easy": 2, "learning": 3}[preset]


def test_an_episode_begins_with_nothing_counted_whatever_was_before() -> None:
    game = started((1,), "learning", **SHORT, controller="qp")
    episode = view(game.state, 0)
    drawn = {name: getattr(episode, name).copy() for name in ("onset", "compromised", "plant", "heat", "series")}
    for values in episode[:-1]:
        values[:] = 7
    episode.metrics[:] = tuple(range(1, 1 + len(episode.metrics.dtype)))
    for name, values in drawn.items():
        getattr(episode, name)[:] = values
    start(game.constants, game.rules, episode._replace(metrics=episode.metrics.view(np.recarray)))
    assert (episode.temperature == 24.0).all()
    np.testing.assert_array_equal(episode.covariance, 1e4 * np.eye(4))
    counted = (
        "squared_error",
        "squared_by_zone",
        "absolute_error",
        "energy_j",
        "residual_sum",
        "used",
        "step",
        "choice",
    )
    shown = ("residual", "mean_residual", "estimate", "fed", "forced", "integrator", "heating", "plan", "recursive")
    for name in (*counted, *shown, "innovation", "innovation_mean"):
        values = getattr(episode, name)
        assert values.size
        assert not values.any(), name
    told = {name: episode.metrics[name][0] for name in episode.metrics.dtype.names}
    assert (told["onset_step"], told["num_compromised"]) == (drawn["onset"], drawn["compromised"].sum())
    for name in ("distinct_sets", "flawed_steps", "model_steps", "rejecting_steps", "discomfort_h", "attack_kwh"):
        assert told[name] == 0.0, name


def test_the_paper_s_group_is_a_prefix_of_the_order() -> None:
    for size, group in ((1, [2]), (2, [1, 2]), (3, [1, 2, 4]), (4, [1, 2, 3, 4])):
        assert (np.flatnonzero(started(num_compromised=size).state.compromised[0]) + 1).tolist() == group


def test_defender_sees_what_moving_targets_need() -> None:
    game = started([1, 2], num_compromised=1)
    go(game, MODEL, num_steps=199)
    view = seen(game, "defender")
    assert (view["ready"] == 0).all()
    assert (view["samples"] == 0).all()
    assert (view["passes"] + view["better_half"] + view["residual"] + view["mean_residual"] == 0).all()
    assert view["estimate"][:, 1:] == pytest.approx(np.repeat(view["estimate"][:, -1:], 15, axis=1))
    go(game, MODEL, READS_22, num_steps=80)
    view, eps = seen(game, "defender"), game.config.threshold_c2
    assert (view["ready"] == 1).all()
    assert view["samples"] == pytest.approx([80, 80], abs=1e-4)
    assert np.expm1(view["residual"]) * eps == pytest.approx(game.state.residual, rel=1e-4, abs=1e-5)
    assert np.expm1(view["mean_residual"]) * eps == pytest.approx(game.state.residual_sum / 80, rel=1e-4, abs=1e-5)
    assert game.mean_residuals() == pytest.approx(game.state.residual_sum / 80)
    assert ((view["passes"] == 1) == (game.mean_residuals() <= eps)).all()
    assert view["better_half"].sum(axis=1).tolist() == [7, 7]
    for b in range(2):
        best = np.argsort(game.state.residual[b], kind="stable")[:7]
        assert set(np.flatnonzero(view["better_half"][b])) == set(best)
    assert view["estimate"] == pytest.approx(np.clip(game.state.estimate, 15, 35), abs=1e-5)
    assert view["reading"] == pytest.approx(game.state.reading, abs=1e-5)
    assert view["heating"] == pytest.approx(game.state.heating, abs=1e-3)
    assert view["last_estimate"] == pytest.approx(game.state.fed, abs=1e-5)
    assert np.argmax(view["last_choice"], axis=1).tolist() == [MODEL, MODEL]
    assert view["outdoor_c"][0] == pytest.approx([game.constants.outdoor[279 + 30 * h] for h in (0, 2, 4, 6)], abs=1e-5)
    assert view["elapsed_h"] == pytest.approx([279 / 30] * 2, abs=1e-5)


def test_attacker_sees_everything_or_its_own_sensors() -> None:
    game, grey = started(num_compromised=2), started(num_compromised=2, attacker_view="grey")
    for each in (game, grey):
        go(each, MODEL, READS_22, num_steps=220)
    view, own = seen(game, "attacker"), seen(grey, "attacker")
    own = {name: values for name, values in own.items() if values.size}  # the others are left out
    assert list(own) == [
        "measured",
        "compromised",
        "active",
        "attack_h",
        "elapsed_h",
        "time_of_day",
    ]
    for name, values in own.items():
        assert (values == view[name]).all(), name
    assert view["measured"][0] == pytest.approx([*game.state.measured[0, :2], 25, 25], abs=1e-5)
    assert view["compromised"][0].tolist() == [1, 1, 0, 0]
    assert view["temperature"][0] == pytest.approx(np.clip(game.state.temperature[0], 15, 35), abs=1e-5)
    assert view["attack_h"][0] == pytest.approx(21 / 30, abs=1e-5)
    assert view["time_of_day"][0] == pytest.approx([np.sin(220 * np.pi / 360), np.cos(220 * np.pi / 360)], abs=1e-6)


def test_the_attacker_sees_the_loop_as_it_is() -> None:
    game = started((1,), "learning", **SHORT, attacker_view="white", attacker_sees_choice=True)
    view, fields = seen(game, "attacker"), game.fields["attacker"]
    for name in ("residual", "mean_residual", "last_choice"):
        assert view[name].shape[1] > 0
        assert not view[name].any(), name  # nothing is chosen yet, and the window is not full
    go(game, 3, np.full(5, 0.2), num_steps=60)
    state, view, eps = game.state, seen(game, "attacker"), game.config.threshold_c2
    expected = {
        "reading": state.reading,
        "residual": np.log1p(state.residual / eps),
        "mean_residual": np.log1p(state.mean_residual / eps),
        "last_choice": np.eye(int(game.action_space["defender"].n))[[3]],
        "last_estimate": state.fed,
        "heating": state.heating,
        "innovation": state.innovation,
        "innovation_mean": state.innovation_mean,
    }
    for name, values in expected.items():
        field = fields[list(fields.slices).index(name)]
        np.testing.assert_allclose(view[name], np.clip(values, field.low, field.high), atol=1e-3, err_msg=name)
        assert view[name].any(), name
    assert game.fields["defender"].slices["estimate"].stop - game.fields["defender"].slices["estimate"].start == (
        4 * int(game.action_space["defender"].n)
    )


@given(st.lists(st.integers(0, 3), min_size=1, max_size=9))
def test_of_equal_sets_the_earlier_ones_are_in_the_better_half(residuals: list[int]) -> None:
    marks = np.zeros(len(residuals))
    mark_better_half(np.array(residuals, np.float64), marks)
    best = np.argsort(residuals, kind="stable")[: len(residuals) // 2]
    assert set(np.flatnonzero(marks)) == set(best)


def test_observations_reach_as_far_as_what_they_show() -> None:
    """Temperatures 10 C around the reference, the outside as far as it swings and 1 C at least."""
    game = started((1,), "learning", attacker_view="white", attacker_sees_choice=True)
    c, hours = game.config, game.config.duration_h
    shares = ("last_choice", "better_half", "passes", "ready", "compromised", "active")
    reach = dict.fromkeys(shares, (0, 1)) | dict.fromkeys(("reading", "measured"), (c.sensor_low_c, c.sensor_high_c))
    reach |= dict.fromkeys(("estimate", "last_estimate", "temperature"), (c.reference_c - 10, c.reference_c + 10))
    reach |= dict.fromkeys(("residual", "mean_residual"), (0, 8)) | {"time_of_day": (-1, 1), "outdoor_c": (4, 16)}
    reach |= dict.fromkeys(("innovation", "innovation_mean"), (-10, 10)) | {"heating": (0, c.max_heating_w)}
    reach |= dict.fromkeys(("elapsed_h", "attack_h"), (0, hours)) | {"samples": (0, c.num_steps)}
    shown = {field.name: field for role in ROLES for field in game.fields[role] if field.size}
    assert {name: (field.low, field.high) for name, field in shown.items()} == reach
    still = started((1,), outdoor_mean_c=10.0, outdoor_swing_c=0.0).fields["defender"]
    assert {(field.low, field.high) for field in still if field.name == "outdoor_c"} == {(9, 11)}


def test_the_attack_is_active_when_the_next_reading_counts() -> None:
    game = started(**SHORT)
    for k in range(60):
        view = seen(game, "attacker")
        assert view["active"][0] == (k + 1 >= 45)
        assert view["attack_h"][0] == pytest.approx(max(k + 1 - 45, 0) / 30, abs=1e-5)
        go(game)


def test_counters() -> None:
    game = started(**SHORT, num_compromised=1)
    for _ in range(89):
        go(game, 4, READS_22)  # {s2}, the flawed one; from k = 40 on
    measured = {name: values[0] for name, values in game.metrics().items()}
    assert measured["distinct_sets"] == 1
    assert measured["flawed_steps"] == 89 - 45
    assert measured["model_steps"] == 0
    assert measured["onset_step"] == 45
    assert measured["num_compromised"] == 1
    game = started(**SHORT)
    go(game, MODEL, num_steps=89)
    assert game.metrics()["model_steps"][0] == 49
    assert game.metrics()["energy_kwh"][0] == pytest.approx(game.state.energy_j[0] / 3.6e6)


def test_scene_is_a_copy_of_the_environment() -> None:
    game = started([0, 1], **SHORT)
    go(game, 3, READS_22, num_steps=60)
    scene = game.scene(1)
    assert (scene.step, scene.onset, scene.choice, scene.ready) == (60, 45, 3, True)
    assert scene.mean_residual == pytest.approx(game.state.residual_sum[1] / 21)
    kept = scene.temperature.copy()
    go(game)
    assert (scene.temperature == kept).all()


def told(game: HvacGame, role: Role = "attacker", **changed: Any) -> Array:
    """What a role would observe if arrays of the state held other values."""
    state = game.state._replace(**{name: np.full_like(getattr(game.state, name), to) for name, to in changed.items()})
    fields = game.fields[role]
    at, rows = fields.offsets.view(np.recarray)[0], np.zeros((game.num_envs, fields.size))
    for b, row in enumerate(rows):
        if role == "attacker":
            observe_attacker(game.constants, game.rules, view(state, b), at, row)
        else:
            observe_defender(game.constants, game.rules, view(state, b), at, row)
    return fields.encode(rows)


@pytest.mark.parametrize("sees", [True, False])
def test_the_attacker_sees_the_choice_only_where_it_may(sees: bool) -> None:
    """Nothing that it observes of a state depends on what the defender chose, or on what follows from the choice."""
    game = started((0, 1), "learning", compromised_weights=(0, 0, 1), attacker_sees_choice=sees)
    go(game, 3, np.full(5, 0.2), num_steps=260)
    now = told(game)
    assert (now == game.observe("attacker")).all()
    for name, other in {"choice": 5, "fed": 22.0, "heating": 770.0}.items():
        differs = told(game, **{name: other}) != now
        assert differs.any() == sees, name
        assert (told(game, "defender", **{name: other}) != told(game, "defender")).any(), name
    shown = seen(game, "attacker")
    hidden = {name for name, values in shown.items() if not values.size}
    assert hidden - {"reference_c"} == (set() if sees else set(BY_CHOICE))
    open_game = started((0, 1), "learning", compromised_weights=(0, 0, 1), attacker_sees_choice=True)
    go(open_game, 3, np.full(5, 0.2), num_steps=260)
    for name, values in seen(open_game, "attacker").items():
        if shown[name].size:
            assert (shown[name] == values).all(), name


def test_presets_hide_the_choice_where_heat_drifts() -> None:
    assert {name: config.attacker_sees_choice for name, config in PRESETS.items()} == {
        "paper": True,
        "easy": True,
        "learning": False,
        "hard": False,
        "weather": False,
    }
