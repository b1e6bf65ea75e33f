"""The game with a filter: noisy readings of front and rear sensors, lies that work late, what replaces a reading."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.declare.config import bounds
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import Array
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.problem import FDI
from cps_envs.fdi.sensors import Sensors, parse_sensors
from cps_paper.fdi.interpretations import INTERPRETATIONS
from tests.fdi.episodes import QUIET, Filter, advance, levels, place, started

EVERY = "x1,2,3,4+v1,2,3,4+rx2,3,4+rv2,3,4>1"
NEUTRAL = np.array([1] * 14 + [4] * 4)


@pytest.mark.parametrize("noise", [{}, {"range_noise_m": (0.1, 0.2, 1, 0.3, 0.1, 0.5, 2), "rate_noise_mps": [0.2] * 7}])
def test_the_filter_is_the_textbook_one(noise: dict[str, Any]) -> None:
    """With random trust, lies and corrections, against matrices with joint updates."""
    game = started(tasks=EVERY, attack_share=1.0, onset_s=0.0, seed=3, **noise)
    filter_, generator = Filter(game), np.random.default_rng(1)
    for _ in range(60):
        state = game.episode(0)
        np.testing.assert_allclose(state.prediction, filter_.x, atol=1e-9)
        np.testing.assert_allclose(state.covariance, filter_.p, atol=1e-9)
        trust = generator.random(14) < 0.7
        filter_.take(state.reading.copy(), trust)
        lies = generator.integers(-1, 2, 14) + game.neutral_action["attacker"]
        advance(game, lies, np.concatenate([trust.astype(int), generator.integers(3, 6, 4)]))
        if game.terminated[0]:
            break
        used = game.episode(0).used
        np.testing.assert_allclose(used[~trust], (filter_.h @ filter_.x)[~trust], atol=1e-9)
        filter_.go_on(game.episode(0).command)
    assert game.state.step[0] > 20


def test_vehicles_follow_what_front_and_rear_sensors_tell_them() -> None:
    """Exact sensors, lies on front and rear: against positions and speeds of single vehicles."""
    game = started(**QUIET, tasks=EVERY)
    c, n = game.config, 4
    position, speed, lie = -c.desired_gap_m * np.arange(n, 0, -1.0), np.zeros(n), np.zeros(14)
    generator = np.random.default_rng(5)
    for _ in range(25):
        ahead, ahead_speed = np.append(position[1:], 0.0), np.append(speed[1:], 0.0)
        gap, rate = ahead - position - c.desired_gap_m, ahead_speed - speed
        front = c.proportional_gain * (gap + lie[:4]) + c.derivative_gain * (rate + lie[7:11])
        rear = c.proportional_gain * (gap[:3] + lie[4:7]) + c.derivative_gain * (rate[:3] + lie[11:])
        command = np.clip(front - np.append(0.0, rear), c.min_acceleration_mps2, c.max_acceleration_mps2)
        chosen = generator.integers(-1, 2, 14)
        advance(game, chosen + game.neutral_action["attacker"])
        position, speed = position + c.dt_s * speed + c.dt_s**2 / 2 * command, speed + c.dt_s * command
        lie = chosen * np.repeat([c.range_resolution_m, c.rate_resolution_mps], 7)
        true = game.episode(0).error
        np.testing.assert_allclose(game.episode(0).command, command, atol=1e-9)
        np.testing.assert_allclose(true[:3], np.diff(position) - c.desired_gap_m, atol=1e-9)
        np.testing.assert_allclose(true[4:7], np.diff(speed), atol=1e-9)


def test_honest_readings_are_noisy_multiples_of_the_resolution() -> None:
    game = started(400, disturbance_mps2=0.0)
    c, offset = game.config, game.config.desired_gap_m
    off = []
    for _ in range(10):
        ranges, rates = game.state.reading[:, :7] + offset, game.state.reading[:, 7:]
        for values, step in ((ranges, c.range_resolution_m), (rates, c.rate_resolution_mps)):
            np.testing.assert_allclose(values / step, np.rint(values / step), atol=1e-9)
        true = game.state.error[:, [0, 1, 2, 3, 0, 1, 2, 4, 5, 6, 7, 4, 5, 6]]
        off.append(game.state.reading - true)
        advance(game)
    spread = np.std(off, axis=(0, 1))
    expected = np.hypot([c.range_noise_m, c.rate_noise_mps], np.array([0.5, 0.25]) / np.sqrt(12))
    np.testing.assert_allclose(spread, np.repeat(expected, 7), rtol=0.06)
    assert np.abs(np.corrcoef(np.reshape(off, (-1, 14)).T) - np.eye(14)).max() < 0.08  # each sensor its own noise


def test_each_sensor_has_its_own_noise() -> None:
    ranges = np.array([0.1, 0.2, 1.0, 0.3, 0.0, 0.5, 2.0])
    game = started(**{**QUIET, "range_noise_m": ranges, "rate_noise_mps": 0.3}, num_envs=256)
    off = game.state.reading - game.state.error[:, [0, 1, 2, 3, 0, 1, 2, 4, 5, 6, 7, 4, 5, 6]]
    np.testing.assert_allclose(np.std(off, axis=0), [*ranges, *[0.3] * 7], rtol=0.15, atol=1e-9)
    with pytest.raises(ConfigurationError, match="range_noise_m has 4 values for 7 range sensors"):
        started(range_noise_m=[0.1] * 4)


def test_a_lie_works_one_step_later_and_not_before_the_onset() -> None:
    game = started(**{**QUIET, "onset_s": 0.5}, tasks="v4>4")
    lie = levels(game, {"v4": 2})
    for step in range(9):
        told = game.state.reading[0, place("v4")] - game.state.error[0, 7]
        assert told == pytest.approx(0.5 if step >= 5 else 0.0)
        mask = game.action_mask("attacker")[0].reshape(14, -1)
        assert mask[place("v4")].sum() == (41 if step >= 4 else 1)
        assert game.fields["attacker"].decode(game.observe("attacker"))["wait"][0] == pytest.approx(max(4 - step, 0))
        advance(game, lie)


def test_an_alarm_takes_so_many_doubted_readings_in_a_row() -> None:
    game = started(**QUIET, tasks="v4>4")
    needed, trusting = round(game.config.alarm_after_s / game.config.dt_s), NEUTRAL
    assert needed > 1
    doubting = NEUTRAL - (np.arange(18) == place("v4"))
    for defense in (*[doubting] * (needed - 1), trusting, *[doubting] * (needed - 1)):
        advance(game, defense=defense)
        assert game.metrics()["detected"][0] == 0
    advance(game, defense=doubting)
    assert game.metrics()["detected"][0] == 1
    assert game.metrics()["time_s"][0] == pytest.approx(2 * needed * game.config.dt_s)


def test_without_attack_nothing_is_ever_injected() -> None:
    game = started(**{**QUIET, "attack_share": 0.0}, tasks="v4>4")
    for _ in range(99):
        advance(game, levels(game, {"v4": 9}))
    assert np.abs(game.state.error).max() == 0
    assert game.metrics()["attacked"][0] == 0


def test_onsets_shares_gains_and_disturbances_are_drawn_as_stated() -> None:
    game = started(3000)
    attacked = game.state.onset < game.horizon
    assert 0.72 < attacked.mean() < 0.78
    assert game.state.onset[attacked].min() == 0
    assert game.state.onset[attacked].max() == 30
    gains = game.fields["attacker"].decode(game.observe("attacker"))["gain"]
    assert gains.min() == pytest.approx(0.8, abs=1e-3)
    assert gains.max() == pytest.approx(1.2, abs=1e-3)
    np.testing.assert_array_equal(gains, game.fields["defender"].decode(game.observe("defender"))["gain"])
    deviation = game.state.disturbance.std(axis=(1, 2))
    assert game.state.disturbance.shape == (3000, 11, 4)  # each for a second, the first and the last for less
    assert np.all(np.abs(np.bincount(game.state.phase.ravel()) / game.state.phase.size - 0.1) < 0.02)
    assert np.abs(np.corrcoef(game.state.phase.T) - np.eye(4)).max() < 0.08
    assert 0.38 < deviation.mean() < 0.41
    assert abs(np.corrcoef(gains.T)[0, 1]) < 0.06


def test_a_disturbance_lasts_as_long_as_stated() -> None:
    quiet = {**QUIET, "disturbance_mps2": 0.4, "disturbance_hold_s": 1.0}
    game = started(**quiet, proportional_gain=1e-4, derivative_gain=1e-3, tasks="v4>4")
    speeds = [game.state.error[0, 7]]
    for _ in range(40):
        advance(game)
        speeds.append(game.state.error[0, 7])
    change = np.diff(speeds).reshape(4, 10)  # of the lead against its reference, which nothing disturbs
    np.testing.assert_allclose(change, np.repeat(change[:, :1], 10, axis=1), atol=2e-3)
    assert np.abs(np.diff(change[:, 0])).min() > 1e-3


def test_each_vehicle_has_disturbances_that_change_at_times_of_their_own() -> None:
    quiet = {**QUIET, "disturbance_mps2": 0.4, "disturbance_hold_s": 1.0, "own_phases": True}
    game = started(**quiet, proportional_gain=1e-4, derivative_gain=1e-3, tasks="v4>4")
    speeds = [game.state.error[0, 4:].copy()]
    for _ in range(40):
        advance(game)
        speeds.append(game.state.error[0, 4:].copy())
    own = -np.diff(speeds, axis=0)[:, ::-1].cumsum(axis=1)[:, ::-1]  # of vehicle i: the gaps from i on
    changes = [set(np.flatnonzero(np.abs(np.diff(own[:, i])) > 1e-3) + 1) for i in range(4)]
    phases = [(-phase) % 10 for phase in game.state.phase[0].tolist()]
    assert changes == [set(range(phase or 10, 40, 10)) for phase in phases]
    assert len(set(phases)) > 1
    assert not started(own_phases=False).state.phase.any()


@pytest.mark.parametrize(
    ("preset", "overrides"),
    [
        ("defense", {"disturbance_hold_s": 0.5}),
        ("drawn", {"disturbance_hold_s": 0.5, "own_phases": True}),
        ("learning", {}),
    ],
)
def test_an_episode_is_drawn_from_its_own_generator_in_one_order(preset: str, overrides: dict[str, Any]) -> None:
    """Task, start, disturbances, phases, noise, attack, gains: what a preset leaves out takes no number."""
    game = FdiGame(FDI.config(preset, overrides), 6)
    game.reset(np.ones(6, np.bool_), [np.random.default_rng(b) for b in range(6)])
    c, n, before = game.config, game.config.num_vehicles, [part[1].copy() for part in game.parts()]
    generators = [np.random.default_rng(10 + b) for b in range(6)]
    game.reset(np.arange(6) != 1, generators)
    for part, kept in zip(game.parts(), before, strict=True):
        np.testing.assert_array_equal(part[1], kept)  # of an episode that goes on
    assert generators[1].random() == np.random.default_rng(11).random()
    for b in (0, 2, 3, 4, 5):
        state, own = game.episode(b), np.random.default_rng(10 + b)
        assert state.task[0] == own.integers(len(game.tasks))
        spread = np.repeat([c.gap_spread_m, c.speed_spread_mps], n)
        np.testing.assert_allclose(state.error, own.uniform(-spread, spread), atol=1e-12)
        pushes, size = own.standard_normal(state.disturbance.shape), c.disturbance_mps2
        phases = [own.integers(c.hold_steps) if pushes.size and c.own_phases else 0 for _ in range(n)]
        assert state.phase.tolist() == phases
        if c.estimator == "kalman":
            np.testing.assert_array_equal(state.noise, own.standard_normal(state.noise.shape))
            attacked, onset_s = own.random() < c.attack_share, own.uniform(*c.onset_s)  # type: ignore[misc]
            assert state.onset[0] == (round(onset_s / c.dt_s) if attacked else game.horizon)
        if c.gain_spread > 0:
            factors = 1 + c.gain_spread * own.uniform(-1, 1, 2)
            np.testing.assert_allclose(game.gains(b), factors * (c.proportional_gain, c.derivative_gain), rtol=1e-12)
            size = own.uniform(*bounds(size))
        np.testing.assert_allclose(state.disturbance, size * pushes, rtol=1e-12)
        assert generators[b].random() == own.random()
    if c.estimator == "kalman":
        assert len(set((game.state.onset == game.horizon).tolist())) == 2  # with and without an attack


def test_a_generator_is_used_where_anything_is_left_to_chance() -> None:
    drawn = {"tasks": "x4>4 v1>1", "gap_spread_m": 0.3, "speed_spread_mps": 0.3, "disturbance_mps2": 0.1}
    for name, value in (*drawn.items(), ("gain_spread", 0.1), ("estimator", "kalman"), ("horizon", 30)):
        preset, clipped = ("drawn", {}) if name == "gain_spread" else ("paper", INTERPRETATIONS["clip"])
        still = {**clipped, "tasks": "", "gap_spread_m": 0.0, "speed_spread_mps": 0.0, "gain_spread": 0.0}
        generator = np.random.default_rng(0)
        FdiGame(FDI.config(preset, {**still, name: value}), 1).reset(np.ones(1, np.bool_), [generator])
        assert (generator.random() != np.random.default_rng(0).random()) == (name != "horizon"), name


def test_drawn_gains_are_those_of_the_commands() -> None:
    quiet = {**QUIET, "gain_spread": 0.2, "speed_spread_mps": 0.2, "gap_spread_m": 0.5}
    game = started(50, **quiet, tasks="v4>4")
    error, gains = game.state.error.copy(), game.fields["defender"].decode(game.observe("defender"))["gain"]
    advance(game)
    expected = gains[:, 0] * error[:, 0] + 3 * gains[:, 1] * error[:, 4]
    np.testing.assert_allclose(game.state.command[:, 0], expected, atol=1e-5)


def outcome(defender: str, **overrides: Any) -> dict[str, Array]:
    config = FDI.config("learning", {"tasks": "v4>4", **QUIET, **overrides})
    action = NEUTRAL.copy()
    action[[place(sensor) for sensor in defender.split()]] = 0
    players = {"attacker": "always?action=21", "defender": f"always?action={action.tolist()}".replace(" ", "")}
    return play_episodes(FDI, config, players, [0])


def test_alarms_count_on_attacked_sensors_while_lies_work_and_in_vain_otherwise() -> None:
    cases = [
        ("v4", {}, 1, 0),
        ("x1", {}, 0, 1),
        ("v4 x1", {}, 1, 1),
        ("", {}, 0, 0),
        ("v4", {"onset_s": 3.0}, 1, 1),
        ("v4", {"attack_share": 0.0}, 0, 1),
        ("v4", {"alarm_after_s": 50.0}, 0, 0),
    ]
    for defender, overrides, detected, in_vain in cases:
        found = outcome(defender, **overrides)
        assert (found["detected"][0], found["false_alarm"][0]) == (detected, in_vain), (defender, overrides)


def test_the_smallest_gap_is_that_of_the_whole_episode() -> None:
    game, smallest = started(tasks="v4>4", attack_share=1.0, onset_s=0.0, seed=8), np.inf
    for _ in range(100):
        smallest = min(smallest, game.state.error[0, :4].min() + 5)
        assert game.metrics()["smallest_gap_m"][0] == pytest.approx(smallest, abs=1e-12)
        if game.terminated[0] or game.elapsed[0] == 100:
            break
        advance(game, levels(game, {"v4": 3}))
    assert smallest < 3


vehicles, followed = st.sets(st.integers(1, 4)), st.sets(st.integers(2, 4))


@given(st.tuples(vehicles, vehicles, followed, followed).filter(any))
@settings(max_examples=200)
def test_sensors_read_as_they_are_written(chosen: Any) -> None:
    sensors = Sensors(*(tuple(sorted(part)) for part in chosen))
    assert parse_sensors(str(sensors), 4) == sensors
    flags = sensors.flags(4, rear=True)
    kinds = zip(("x", "v", "rx", "rv"), chosen, strict=True)
    assert set(flags.nonzero()[0]) == {place(f"{kind}{vehicle}") for kind, part in kinds for vehicle in part}


def test_a_rear_sensor_of_either_kind_is_one_and_other_texts_are_refused() -> None:
    assert [parse_sensors(text, 4).has_rear for text in ("x4", "xv1", "rv2", "rx2+x3")] == [False, False, True, True]
    for text in ("", "y4", "x", "x4+"):
        with pytest.raises(ConfigurationError, match="names no sensors"):
            parse_sensors(text, 4)


def test_the_scene_shows_what_the_filter_believes_and_names_rear_sensors() -> None:
    game = started(tasks="xv1+rv2>1", attack_share=1.0, onset_s=0.0)
    for _ in range(12):
        advance(game, levels(game, {"x1": 2, "v1": 2, "rv2": 2}))
    scene = game.scene(0)
    np.testing.assert_allclose(scene.believed_gap, game.state.prediction[0, :4] + 5)
    assert scene.attacked.nonzero()[0].tolist() == [0, 4, 11]  # fronts by kind, rears by kind
    np.testing.assert_allclose(scene.injection[[0, 4, 11]], [1.0, 0.5, 0.5])
    from cps_envs.fdi.picture.course import name_of
    from cps_envs.fdi.picture.outcome import task_of

    assert "rear range-rate of 2" in task_of(scene)
    assert [name_of(sensor, 4)[0] for sensor in (0, 4, 8, 11)] == ["x1", "v1", "rx2", "rv2"]


def test_every_step_pays_what_its_charges_and_impacts_add() -> None:
    """The sum of the steps so far is what the metrics say, at every step: nothing is paid twice."""
    game, generator, total = started(tasks=EVERY, attack_share=1.0, onset_s=0.0, seed=3), np.random.default_rng(2), 0.0
    paid = []
    for _ in range(30):
        actions = {
            "attacker": (generator.integers(-1, 2, 14) + game.neutral_action["attacker"])[np.newaxis],
            "defender": np.concatenate([generator.integers(0, 2, 14), generator.integers(3, 6, 4)])[np.newaxis],
        }
        paid.append(float(game.advance(actions, np.ones(1, np.bool_), 1)[0]))
        total += paid[-1]
        found = {name: float(values[0]) for name, values in game.metrics().items()}
        expected = sum(found[name] for name in ("impact_speed_mps", "alarm_cost_mps", "correction_cost_mps"))
        assert total == pytest.approx(expected, abs=1e-12)
        if game.terminated[0]:
            break
    assert len(paid) > 10
    assert max(paid[:-1]) < 0.5 * total  # a running sum would pay nearly all of it in the last step


def test_an_episode_that_is_attacked_says_so() -> None:
    for share in (0.0, 1.0):
        game = started(attack_share=share, onset_s=0.0)
        assert game.metrics()["attacked"].tolist() == [share]
