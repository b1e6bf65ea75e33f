"""The game of the robots: its numbers, what it does, what it pays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding.corrections import CopyDisbanded
from cps_envs.core.compute.kernels import view
from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.disbanding.fields import vehicle_fields
from cps_paper.testbed.cases import mitigation
from cps_paper.testbed.robots.config import BASELINE, MITIGATED, RobotConfig
from cps_paper.testbed.robots.game import RobotGame
from cps_paper.testbed.robots.payoff import METRICS, measure_episode, velocity_error
from cps_paper.testbed.robots.picture.scene import desired_arcs
from cps_paper.testbed.robots.problem import ATTACK, TESTBED, attack_fields, defense_fields
from cps_paper.testbed.robots.state import Robots, allocate, rules_of

ONE = np.ones(1, np.bool_)
SHORT = replace(BASELINE, duration_s=24.0, measured_from_s=10.0, measured_for_s=10.0)
EARLY = "plan?events=[[3, 10]]"
INTACT = np.array([False] * 3 + [True] * 6)


def test_the_road_is_ten_times_as_large_and_has_the_limits_of_table_2_1() -> None:
    road = BASELINE.road
    assert (road.min_acceleration_mps2, road.max_acceleration_mps2) == (-5.0, 1.0)
    assert (road.desired_speed_mps, road.max_speed_mps) == pytest.approx((2.5, 3.5))
    assert (road.desired_gap_m, road.standstill_gap_m) == pytest.approx((3.5, 2.4))
    assert (road.headway_s, road.driver_headway_s, road.control_period_s, road.duration_s) == (1.0, 1.3, 0.05, 60.0)
    assert (road.proportional_gain, road.derivative_gain, road.num_platoons) == (1.0, 3.0, 3)


def test_numbers_of_the_loop() -> None:
    assert (BASELINE.num_robots, BASELINE.steps_per_period, BASELINE.delay_periods, BASELINE.num_periods) == (
        9,
        5,
        1,
        1200,
    )
    assert BASELINE.window == (400, 1000)
    assert BASELINE.string_length_m == pytest.approx(6 * 0.35 + 2 * 0.25 + 0.10)
    assert replace(BASELINE, avoidance="until_disbanding") == MITIGATED
    assert BASELINE.speed_gain == pytest.approx(BASELINE.wheel_lag_s / BASELINE.control_period_s - 1.0)
    assert rules_of(RobotConfig(camera_noise_m=0.0)).camera_variance_m2 == pytest.approx(1e-8)
    assert rules_of(BASELINE).camera_variance_m2 == pytest.approx(0.25e-6)


def test_observations_are_those_of_the_road() -> None:
    game = TESTBED.game(BASELINE, 1)
    assert game.fields["attacker"].size == attack_fields(BASELINE).size
    assert game.fields["defender"].size == defense_fields(BASELINE).size


def play(
    defender: Any = "none", config: RobotConfig = BASELINE, seeds: Sequence[int] = (0,), attacker: str = ATTACK
) -> tuple[dict[str, Any], RobotGame]:
    games: list[Any] = []
    players = {"attacker": attacker, "defender": defender}
    outcome = play_episodes(TESTBED, config, players, seeds, on_step=games.append)  # type: ignore[arg-type]
    return outcome, games[-1]


@pytest.fixture(scope="module")
def quiet() -> RobotGame:
    return play(attacker="none", seeds=range(6))[1]


def test_without_disbanding_speeds_gaps_and_tracks_are_kept(quiet: RobotGame) -> None:
    robots = quiet.robots
    error = 100 * np.abs(robots.speeds[:, 401:1001, 3:] - 0.25).mean(axis=(1, 2)) / 0.25
    assert error.max() < 6.5
    assert error.mean() == pytest.approx(3.2, abs=1.0)  # the specification's mean over ten seeds
    for b in range(6):
        for period in range(0, 400, 20):
            speeds, arcs = robots.speeds[b, period], robots.arcs[b, period]
            wanted = desired_arcs(arcs, speeds, quiet.string.disbanding_s[b], BASELINE)
            assert np.nanmax(np.abs(arcs - wanted)) < 0.15
    assert np.abs(np.hypot(robots.pose[..., 0], robots.pose[..., 1]) - 1.5).max() < 0.03
    assert not quiet.string.collided.any()


def test_estimates_are_near_the_truth_and_shown_ten_times_as_large(quiet: RobotGame) -> None:
    robots = quiet.robots
    assert np.abs(robots.estimate[..., :2] - robots.pose[..., :2]).max() < 0.002
    assert np.sqrt(np.mean((robots.estimate[..., 3] - robots.speed) ** 2)) < 0.01
    seen = quiet.fields["defender"].decode(quiet.observe("defender"))
    np.testing.assert_allclose(seen["speed"], 10 * robots.estimate[..., 3], atol=1e-5)
    np.testing.assert_allclose(seen["gap"], 10 * -np.diff(robots.arc), atol=0.03)
    np.testing.assert_allclose(seen["acceleration"], quiet.string.command, atol=1e-5)
    np.testing.assert_allclose(seen["time_s"], 60.0, atol=1e-4)


def test_the_attacker_sees_the_string_too(quiet: RobotGame) -> None:
    seen = quiet.fields["attacker"].decode(quiet.observe("attacker"))
    np.testing.assert_allclose(seen["mean_speed"], quiet.string.speed.reshape(6, 3, 3).mean(axis=2)[:, ::-1], atol=1e-5)
    assert quiet.action_mask("attacker")[0].tolist() == [True] * 4


def test_environments_are_the_single_episodes_and_seeds_differ() -> None:
    batch, _ = play("heuristic", SHORT, (3, 4, 5), EARLY)
    for b, seed in enumerate((3, 4, 5)):
        alone, _ = play("heuristic", SHORT, (seed,), EARLY)
        for name, values in alone.items():
            assert values[0] == batch[name][b], name
    assert len(set(batch["velocity_error"])) == 3


def test_the_return_is_the_velocity_error_of_the_true_speeds() -> None:
    outcome, game = play("none", SHORT, (1,), EARLY)
    error = 100 * np.abs(game.robots.speeds[0, 201:401, 3:] - 0.25).mean() / 0.25
    assert outcome["return"][0] == pytest.approx(error)
    assert outcome["velocity_error"][0] == pytest.approx(error)


def test_a_game_can_be_reset() -> None:
    game = TESTBED.game(SHORT, 2)
    both = np.ones(2, np.bool_)
    game.reset(both, [np.random.default_rng(seed) for seed in (0, 1)])
    start = game.observe("defender")
    game.advance({"attacker": np.array([0, 0])}, both, 100)
    went = game.robots.arcs[1].copy()
    game.reset(np.array([True, False]), [np.random.default_rng(seed) for seed in (0, 1)])
    np.testing.assert_array_equal(game.observe("defender")[0], start[0])
    np.testing.assert_array_equal(game.robots.arcs[1], went)


def test_orders_act_after_the_delay_of_the_radio() -> None:
    for delay_periods in (0, 1, 2):
        config = replace(SHORT, radio_delay_s=0.05 * delay_periods, speed_noise_mps=0.0, camera_noise_m=0.0)
        plain, braked = (TESTBED.game(config, 1) for _ in range(2))
        for game, correction in ((plain, 0.0), (braked, -1.0)):
            game.reset(ONE, [np.random.default_rng(0)])
            game.advance({"attacker": np.array([0])}, ONE, 20)
            game.advance({"attacker": np.array([3]), "defender": np.full((1, 9), correction)}, ONE, 10)
        changed = (plain.robots.speeds != braked.robots.speeds)[0, :, 3:].all(axis=1)
        assert int(np.argmax(changed)) == 21 + delay_periods


@pytest.mark.parametrize("defender", ["none", "heuristic", "heuristic?horizon_s=1", "copy", "feedback", "mpc"])
def test_any_disbanding_defender_plays_by_name(defender: str) -> None:
    outcome, _ = play(defender, SHORT, (0, 1), EARLY)
    assert np.all((outcome["velocity_error"] > 1.0) & (outcome["velocity_error"] < 60.0))
    assert outcome["collided"].tolist() == [0, 0]


class Learned:
    """What a stable-baselines3 model looks like; it remembers the shapes that it was asked with."""

    shape: tuple[int, ...] = ()

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False
    ) -> Any:
        assert observation.dtype == np.float32
        assert np.abs(observation).max() <= 1.0
        self.shape = observation.shape
        return np.full((len(observation), 9), -0.05, np.float32), state


def test_models_and_attributes_play_too() -> None:
    model = Learned()
    learned, game = play(model, SHORT, (0,), EARLY)
    assert model.shape == (1, game.fields["defender"].size)
    assert learned["velocity_error"] != play("none", SHORT, (0,), EARLY)[0]["velocity_error"]
    named, _ = play("cps_baselines.disbanding.corrections:CopyDisbanded", SHORT, (0,), EARLY)
    assert named["velocity_error"] == play("copy", SHORT, (0,), EARLY)[0]["velocity_error"]


def test_policies_are_told_the_road() -> None:
    spec: RoleSpec = TESTBED.game(BASELINE, 1).spec("defender")
    assert spec.problem == "disbanding"
    assert spec.config == BASELINE.road
    assert CopyDisbanded(spec).limit_mps2 == pytest.approx(6.0)


def test_the_mitigation_wins_against_the_baseline_under_the_same_seed() -> None:
    base, short, long = (
        play(mitigation(t_s, config) if t_s else "none", config, range(3))[0]
        for t_s, config in ((None, BASELINE), (0.5, MITIGATED), (1.0, MITIGATED))
    )
    assert np.all(base["velocity_error"] > short["velocity_error"])
    assert np.all(short["velocity_error"] > long["velocity_error"])
    assert np.all(short["smallest_gap_m"] > long["smallest_gap_m"])
    assert np.all(short["rms_acceleration_mps2"] < 0.85 * base["rms_acceleration_mps2"])
    assert not np.any(short["stopped"] + long["stopped"])


def test_looking_changes_nothing() -> None:
    def look(game: Game) -> None:
        game.observe("defender")
        game.observe("attacker")
        game.metrics()
        game.scene(0)

    players: dict[Any, Any] = {"attacker": EARLY, "defender": "none"}
    looked_at = play_episodes(TESTBED, SHORT, players, (0,), on_step=look)
    assert looked_at["velocity_error"] == play("none", SHORT, (0,), EARLY)[0]["velocity_error"]


def test_each_robot_sees_its_own_row_as_a_vehicle_of_the_string() -> None:
    rows: list[dict[str, Any]] = []

    def look(game: Game) -> None:
        team = game.team("defender")
        own = vehicle_fields(SHORT.road).decode(team.observe())
        whole = game.fields["defender"].decode(game.observe("defender"))
        for name in ("speed", "acceleration", "law_command"):
            np.testing.assert_allclose(own[name][:, 3:], whole[name][:, 3:], atol=1e-5)
        np.testing.assert_array_equal(own["mitigable"][:, 3:], whole["mitigable"])
        rows.append(own)

    players: dict[Any, Any] = {"attacker": EARLY, "defender": "none"}
    play_episodes(TESTBED, SHORT, players, range(2), on_step=look)
    assert (rows[-1]["active"][0] == [0, 0, 0, 1, 1, 1, 1, 1, 1]).all()
    team = TESTBED.game(SHORT, 2).team("defender")
    assert team.agents[0] == "robot_0"
    np.testing.assert_array_equal(team.rewards(np.array([1.0, 0.0])), np.repeat([[-1.0], [0.0]], 9, axis=1))


def robots() -> Robots:
    """One environment in which robots drive at 0.25 m/s with gaps of 0.35 m for 60 s."""
    made = allocate(BASELINE, 1)
    made.speeds[:] = 0.25
    made.arcs[:] = 0.25 * 0.05 * np.arange(1201)[:, np.newaxis] - 0.35 * np.arange(9)
    return made


def measured(made: Robots, period: int = 1200) -> dict[str, float]:
    error = velocity_error(made.error[0], np.array([20.0, np.inf, np.inf]), rules_of(BASELINE))
    return dict(zip(METRICS, [error, *measure_episode(view(made, 0), period, INTACT, BASELINE)], strict=True))


def test_steady_driving() -> None:
    assert measured(robots()) == pytest.approx(
        {
            "velocity_error": 0.0,
            "lowest_speed_mps": 0.25,
            "stopped": 0.0,
            "smallest_gap_m": 0.35,
            "collided": 0.0,
            "rms_acceleration_mps2": 0.0,
        }
    )


def test_what_happens_before_the_window_or_to_the_disbanded_does_not_count() -> None:
    made = robots()
    made.speeds[0, :400, 5] = 0.0
    made.speeds[0, :, :3] = 0.0
    made.error[0, :3] = 1e6
    made.arcs[0, :400, 5] += 0.2
    made.arcs[0, :, 1] += 0.3  # robot 8 near robot 9
    assert measured(made) == measured(robots())


def test_events_in_the_window() -> None:
    made = robots()
    made.speeds[0, 500:520, 8] = 0.005
    made.speeds[0, 510, 7] = 0.02
    made.arcs[0, 700, 6] += 0.26
    found = measured(made)
    assert found["lowest_speed_mps"] == 0.005
    assert found["stopped"] == 1
    assert found["smallest_gap_m"] == pytest.approx(0.09)
    assert found["collided"] == 1
    squares = 2 * (0.245 / 0.05) ** 2 + 2 * (0.23 / 0.05) ** 2
    assert found["rms_acceleration_mps2"] == pytest.approx(np.sqrt(squares / (6 * 600)))
    assert measured(made, 499)["stopped"] == 0


def test_velocity_error_is_the_mean_relative_error_in_percent() -> None:
    made = robots()
    made.error[0, 3:] = 600 * 0.05  # every sample of the window is off by 0.05 m/s
    assert measured(made)["velocity_error"] == pytest.approx(20.0)
    made.error[0, 3:6] = 0.0
    assert measured(made)["velocity_error"] == pytest.approx(10.0)
