"""What is drawn beside the start: quiet episodes, when attacks open, drivers who brake, members, noise."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from cps_envs.core.compute.kernels import view
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.disbanding.start import nominal_constants, place, undisturbed, whole_steps
from tests import episodes
from tests.disbanding.rounds import go

started = partial(episodes.started, DISBANDING, preset="learning")


def test_new_draws_shift_no_old_one() -> None:
    easy, contested = started(range(5), preset="easy"), started(range(5))
    for name in ("tau_s", "desired_gap_m", "num_vehicles"):
        assert np.array_equal(easy.constants[name], contested.constants[name])
    for name in ("position", "speed", "takeover_delay_s", "driver_headway_s"):
        assert np.array_equal(getattr(easy.state, name), getattr(contested.state, name))


def test_a_start_is_drawn_from_its_own_generator_in_one_order() -> None:
    """Platoons, lag, gap, budget, then gaps, speeds, delays and headways of all vehicles; the others go on."""
    game = started(range(6), preset="easy", num_platoons=(2, 4), vehicles_per_platoon=3, attack_budget=(1, 2))
    c, before = game.config, [part[1].copy() for part in game.parts()]
    game.reset(np.arange(6) != 1, [np.random.default_rng(10 + b) for b in range(6)])
    for part, kept in zip(game.parts(), before, strict=True):
        np.testing.assert_array_equal(part[1], kept)
    for b in (0, 2, 3, 4, 5):
        own, state, numbers = np.random.default_rng(10 + b), view(game.state, b), game.constants[b]
        vehicles = 3 * own.integers(2, 5)
        assert numbers["num_vehicles"] == vehicles
        lag_and_gap = (own.uniform(0.1, 0.5), own.uniform(4, 6))
        np.testing.assert_allclose((numbers["tau_s"], numbers["desired_gap_m"]), lag_and_gap, rtol=1e-12)
        assert game.budget[b] == own.integers(1, 3)
        low, high = np.array([(-0.03, 0.03), (-0.3, 0.3), (0, 2), (1.2, 1.8)]).T[..., np.newaxis]
        gap, speed, delay, headway = own.uniform(low, high, (4, 12))[:, :vehicles]
        steady = np.where(np.arange(vehicles) % 3 == 0, 1.5 * c.desired_speed_mps, numbers["desired_gap_m"])
        steady[0] = 0.0  # the front vehicle
        expected = {
            "position": -np.cumsum(steady * (1 + gap)),
            "speed": c.desired_speed_mps + speed,
            "takeover_delay_s": delay,
            "driver_headway_s": headway,
        }
        for name, values in expected.items():
            np.testing.assert_allclose(getattr(state, name)[:vehicles], values, atol=1e-9, err_msg=name)
            assert not getattr(state, name)[vehicles:].any(), name


def test_an_episode_begins_with_nothing_counted_whatever_was_before() -> None:
    game = started((1, 2), preset="paper", num_platoons=2, vehicles_per_platoon=3)
    for values in game.state:
        values[:] = 7
    place(game.state, game.constants, undisturbed(game.constants, 6), np.array([True, False]))
    first = {name: values[0] for name, values in game.state._asdict().items() if name != "chance"}
    for name in ("disbanding_s", "previous_gap", "record_s", "smallest_gap", "attacked_s"):
        assert np.isinf(first.pop(name)).all(), name
    assert (first.pop("first_collision_s"), first.pop("jam_place"), first.pop("attacked_member")) == (-1, -1, 1)
    assert first.pop("moving").all()
    np.testing.assert_allclose(first.pop("position"), [0, -5, -10, -56.5, -61.5, -66.5])
    assert (first.pop("speed") == 31).all()
    assert (first.pop("driver_headway_s") == 1.5).all()
    for name, values in first.items():
        assert not values.any(), name
    assert all((values[1] == (values.dtype == bool or 7)).all() for values in game.state)  # of the episode that goes on


def test_publicly_known_is_the_middle_of_what_is_drawn() -> None:
    known = nominal_constants(DISBANDING.config("learning", {}))
    assert (known.tau_s, known.desired_gap_m, known.hop_loss) == pytest.approx((0.3, 5.0, 0.15))
    assert (known.hop_steps, known.period_steps, known.noise_steps) == (10, 10, 100)
    assert (known.num_vehicles, known.min_speed_mps, known.ride_steps) == (100, 0.0, 0)
    assert (known.relayed, known.corrects_all, known.stop_at_collision) == (True, True, False)
    assert known.noise_width_mps2 == pytest.approx(np.sqrt(3) / 2)
    other = nominal_constants(DISBANDING.config("paper", {"on_collision": "end", "report": "full"}))
    assert (other.relayed, other.corrects_all, other.stop_at_collision, other.ride_steps) == (False, False, True, 10)
    assert [whole_steps(time_s, 0.01) for time_s in (0.0, 0.004, 0.026)] == [1, 1, 3]


def test_an_element_that_is_off_draws_nothing() -> None:
    generators = [np.random.default_rng(3) for _ in range(2)]
    for generator, overrides in zip(generators, ({}, {"warning": "relayed", "report": "safety"}), strict=True):
        game = DisbandingGame(DISBANDING.config("paper", overrides), 1)
        game.reset(np.ones(1, bool), [generator])
    drawn = [generator.bit_generator.state["state"]["state"] for generator in generators]
    assert drawn[0] != drawn[1]  # the radio's stream
    fresh = np.random.default_rng(3)
    fresh.random(2)
    fresh.random((4, 100))
    assert drawn[0] == fresh.bit_generator.state["state"]["state"]


def test_a_share_of_the_episodes_is_quiet_and_the_others_open_at_any_time() -> None:
    game = started(range(400))
    quiet = game.budget == 0
    assert abs(quiet.mean() - 0.25) < 4 * np.sqrt(0.25 * 0.75 / 400)
    assert np.array_equal(quiet, game.state.jam_steps == 0)
    assert set(game.budget[~quiet]) == {1, 2, 3}
    assert set(game.state.jam_steps[~quiet]) == {500, 600, 700, 800, 900, 1000}
    assert set(game.state.opening_s) <= set(range(1, 61))
    assert game.state.opening_s.min() <= 3
    assert game.state.opening_s.max() >= 58
    hops, losses = game.constants["hop_steps"], game.constants["hop_loss"]
    assert hops.min() >= 5
    assert hops.max() <= 15
    assert 0 <= losses.min() < 0.02 < 0.28 < losses.max() < 0.3


def test_in_a_quiet_episode_nothing_is_legal_but_waiting() -> None:
    game = started((0,), quiet_share=1.0)
    for _ in range(100):
        assert game.action_mask("attacker")[0].tolist() == [True] + [False] * 19
        go(game, attack=10)
    assert np.isinf(game.state.disbanding_s).all()
    assert game.state.jam_place[0] == -1


def test_attacks_open_late_and_keep_a_pause() -> None:
    game = started((0,), quiet_share=0.0, earliest_attack_s=7, attack_budget=2)
    legal = []
    for second in range(16):
        legal.append(bool(game.action_mask("attacker")[0, 10 if second < 8 else 9]))
        shown = game.fields["attacker"].decode(game.observe("attacker"))["opens_in_s"][0]
        assert shown == pytest.approx(max(0, 7 - second) if second < 8 else max(0, 12 - second), abs=1e-4)
        go(game, attack=10)
    assert legal == [second == 7 or second >= 12 for second in range(16)]


def test_members_hear_of_the_attack_one_after_the_other() -> None:
    plain = started((4,), preset="paper").state.takeover_delay_s[0]
    told = started((4,), preset="paper", member_delay_s=0.5, attacked_member=3).state.takeover_delay_s[0]
    hops = np.array([2, 1, 0, 1, 2, 3, 4, 5, 6, 7])
    np.testing.assert_allclose(told - plain, np.tile(0.5 * hops, 10))


def test_some_drivers_brake_when_they_take_over() -> None:
    braking = {"braking_share": 0.3, "braking_mps2": (2.0, 5.0), "braking_s": (0.5, 1.5)}
    game = started(range(30), preset="paper", **braking)
    brakes = game.state.braking_s > 0
    assert abs(brakes.mean() - 0.3) < 4 * np.sqrt(0.3 * 0.7 / 3000)
    assert np.all((game.state.braking_s[brakes] >= 0.5) & (game.state.braking_s[brakes] <= 1.5))
    assert np.all((game.state.braking_mps2[brakes] >= 2.0) & (game.state.braking_mps2[brakes] <= 5.0))
    go(game)
    go(game, attack=10, num_steps=1)
    front = game.state.command[:, :10]
    hard = -game.state.braking_mps2[:, :10]
    assert np.all(front[brakes[:, :10]] <= hard[brakes[:, :10]] + 1e-12)
    go(game, num_steps=15)  # every driver has stopped braking by then; the front one has a free road
    assert np.all(game.state.command[:, 0] >= 0)


def test_actuators_add_noise_to_corrections_only() -> None:
    setting = {"correctable": "intact", "control_period_s": 0.01}
    noisy, exact = (
        started(range(20), preset="paper", correction_noise_mps2=deviation, **setting) for deviation in (0.5, 0.0)
    )
    correction = np.zeros((20, 100))
    correction[:, ::2] = 0.1
    for game in (noisy, exact):
        go(game, correction=correction, num_steps=1)
    same = noisy.state.command == exact.state.command
    assert same[:, 1::2].all()
    assert not same[:, ::2].any()
    drawn = noisy.state.noise_mps2
    assert abs(drawn.std() - 0.5) < 0.03
    assert abs(drawn.mean()) < 0.05
    assert np.abs(drawn).max() <= 0.5 * np.sqrt(3)
    before = drawn.copy()
    go(noisy, num_steps=98)
    assert np.array_equal(drawn, before)  # for one second
    go(noisy, num_steps=2)
    assert not np.array_equal(drawn, before)


def test_noise_is_added_to_the_limited_command_and_the_correction() -> None:
    game = started((1,), preset="paper", correction_noise_mps2=0.5, correctable="intact", control_period_s=0.01)
    go(game, correction=np.full((1, 100), 0.2), num_steps=1)
    np.testing.assert_allclose(game.state.command[0], 1.2 + game.state.noise_mps2[0], atol=1e-9)  # the law says 0


def test_safety_metrics_are_reported_on_demand() -> None:
    assert "smallest_gap_m" not in started(preset="paper").metrics()
    game = started((0,), preset="paper", report="safety", correctable="intact")
    assert game.metrics()["smallest_gap_m"][0] == pytest.approx(5.0)
    correction = np.zeros((1, 100))
    correction[0, :25] = 0.5
    go(game, correction=correction)
    go(game, attack=9, correction=correction)  # its own platoon and those behind have a reason; ten vehicles have none
    expected = 100 * (10 * 0.25 + 10 * 0.10) / 1800
    assert game.metrics()["false_alarms"][0] == pytest.approx(expected)
    gaps = -np.diff(game.state.position[0])
    assert game.metrics()["smallest_gap_m"][0] <= gaps.min() + 1e-9
