"""The game on the kernels: presets, moves, payoff, episode ends, draws, and what the roles observe."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.compute.kernels import records, view
from cps_envs.core.declare.config import is_multiple
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.team import grouped
from cps_envs.disbanding.config import EASY, PAPER
from cps_envs.disbanding.fields import vehicle_fields
from cps_envs.disbanding.payoff import Metrics, charge, measured
from cps_envs.disbanding.problem import DISBANDING
from tests import episodes
from tests.disbanding.rounds import go, seen
from tests.episodes import play

started = partial(episodes.started, DISBANDING, duration_s=20.0, num_platoons=4)


def test_paper_is_table_2_1_and_deterministic() -> None:
    assert (PAPER.num_platoons, PAPER.vehicles_per_platoon, PAPER.duration_s) == (10, 10, 180.0)
    assert (PAPER.proportional_gain, PAPER.derivative_gain, PAPER.headway_s) == (1.0, 5.0, 1.5)
    assert PAPER.gap_spread == PAPER.speed_spread_mps == PAPER.takeover_delay_s == PAPER.collision_penalty == 0.0
    assert PAPER.horizon_steps == 18_000
    assert PAPER.steps_per_period == 10
    assert PAPER.periods_per_second == 10


def test_learning_draws_what_the_specification_says() -> None:
    assert EASY.tau_s == (0.1, 0.5)
    assert EASY.desired_gap_m == (4.0, 6.0)
    assert EASY.collision_penalty == 0.3
    assert EASY.max_budget == 3


@given(part=st.sampled_from([0.01, 0.02, 0.05, 0.1, 0.25, 1.0]), count=st.integers(1, 2000))
def test_multiples(part: float, count: int) -> None:
    assert is_multiple(part * count, part)
    assert not is_multiple(part * (count + 0.5), part)


def test_nothing_is_legal_before_the_first_second() -> None:
    game = started()
    assert game.action_mask("attacker")[0].tolist() == [True, False, False, False, False]
    go(game, attack=4)
    assert np.isinf(game.state.disbanding_s).all()
    assert game.action_mask("attacker").all()


def test_a_platoon_is_disbanded_once_and_the_budget_ends() -> None:
    game = started(attack_budget=2)
    go(game)
    for attack, legal in ((4, [0, 1, 2, 3]), (4, [0, 1, 2, 3]), (2, [0]), (1, [0])):
        go(game, attack=attack)
        assert np.flatnonzero(game.action_mask("attacker")[0]).tolist() == legal
    assert game.state.disbanding_s[0].tolist() == [1.0, np.inf, 3.0, np.inf]


def test_the_attacker_moves_at_whole_seconds_only() -> None:
    game = started()
    go(game, num_steps=13)
    assert game.action_mask("attacker")[0].sum() == 1
    go(game, attack=3, num_steps=1)
    assert np.isinf(game.state.disbanding_s).all()


@given(st.lists(st.integers(0, 4), min_size=20, max_size=20), st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_the_return_is_the_sum_of_its_parts_and_corrections_keep_bounds(attacks: Any, seed: int) -> None:
    game = started(seeds=(seed, seed + 1), preset="easy", attack_budget=3)
    generator = np.random.default_rng(seed)
    total = np.zeros(2)
    for attack in attacks:
        total += go(game, attack=attack, correction=generator.uniform(-1, 1, (2, 40)), num_steps=10)
        assert np.all((game.state.speed >= 0) & (game.state.speed <= 36))
    parts = sum(game.metrics()[name] for name in game.payoff_parts)
    assert np.allclose(total, parts, atol=1e-9)


def test_platoon_corrections_are_broadcast_in_the_paper_s_numbering() -> None:
    game = started(defense_action="platoon")
    rows = np.arange(4.0)[np.newaxis]  # row i - 1 = platoon i, 1 = rear
    assert game.by_vehicle(rows)[0].tolist() == np.repeat([3.0, 2.0, 1.0, 0.0], 10).tolist()


def test_a_collision_ends_the_episode_and_charges_the_rest() -> None:
    outcome = play(DISBANDING, "lead", tau_s=0.5, on_collision="end")
    crash_s = outcome["first_collision_s"][0]
    assert crash_s == pytest.approx(4.19)  # spec 6.8, from 3.19 s after the attack
    assert outcome["end_charge"][0] == pytest.approx(100 * (1 - crash_s / 180))
    assert outcome["return"][0] == pytest.approx(outcome["velocity_error_all"][0] + outcome["end_charge"][0])


def test_the_penalty_counts_intact_vehicles_scaled_to_a_hundred() -> None:
    outcome = play(DISBANDING, "lead", tau_s=0.3, collision_penalty=0.3, num_platoons=5)
    assert outcome["collided_intact"][0] > 0
    assert outcome["collision_penalty"][0] == pytest.approx(0.3 * 100 / 50 * outcome["collided_intact"][0])


def test_the_other_payoff_is_the_error_of_the_intact() -> None:
    outcome = play(DISBANDING, "lead", payoff_set="intact_now")
    assert outcome["return"][0] == pytest.approx(outcome["velocity_error_intact"][0])  # one attack: spec 2.8
    assert outcome["return"][0] == pytest.approx(29.556830, abs=1e-4)


def test_learning_draws_within_its_ranges() -> None:
    game = started(seeds=range(50), preset="easy", num_platoons=(2, 4), attack_budget=(1, 2))
    p = game.constants
    assert set(p["num_vehicles"]) == {20, 30, 40}
    assert p["tau_s"].min() >= 0.1
    assert p["tau_s"].max() <= 0.5
    assert np.ptp(p["tau_s"]) > 0.2
    assert set(game.budget) == {1, 2}
    assert np.all((game.state.takeover_delay_s >= 0) & (game.state.takeover_delay_s <= 2))
    absent = np.arange(40) >= p["num_vehicles"][:, np.newaxis]
    assert np.all(game.state.speed[absent] == 0)


def test_attacker_rows_are_in_the_paper_s_numbering() -> None:
    game = started()
    go(game)
    go(game, attack=4, num_steps=50)
    view = seen(game, "attacker")
    speed = game.state.speed[0].reshape(4, 10)[::-1]  # row i - 1 = platoon i
    assert np.allclose(view["mean_speed"][0], speed.mean(axis=1), atol=1e-4)
    assert np.allclose(view["min_speed"][0], speed.min(axis=1), atol=1e-4)
    assert view["disbanded"][0].tolist() == [0, 0, 0, 1]
    assert view["since_disbanding_s"][0, 3] == pytest.approx(5.0, abs=1e-4)
    gaps = -np.diff(game.state.position[0])
    assert np.allclose(view["leader_gap"][0], gaps[[29, 19, 9]], atol=1e-3)
    inner = np.delete(gaps, [9, 19, 29]).reshape(4, 9)[::-1]
    assert np.allclose(view["min_gap"][0], inner.min(axis=1), atol=1e-3)
    assert np.allclose(view["mean_gap"][0], inner.mean(axis=1), atol=1e-3)
    assert view["budget_left"][0] == pytest.approx(1)


def test_defender_sees_vehicles_front_to_rear_and_the_broadcast_ahead() -> None:
    game = started()
    go(game)
    go(game, attack=3, num_steps=50)
    view, state = seen(game, "defender"), game.state
    assert np.allclose(view["speed"][0], state.speed[0], atol=1e-4)
    assert np.allclose(view["gap"][0], -np.diff(state.position[0]), atol=1e-3)
    assert np.allclose(view["relative_speed"][0], -np.diff(state.speed[0]), atol=1e-4)
    assert view["mitigable"][0].tolist() == [0] * 10 + [1] * 20
    assert view["ahead_speed"][0] == pytest.approx([state.speed[0, 19]] * 2 + [31.0], abs=1e-4)
    distance = state.position[0, 19] - state.position[0, [30, 20]]
    assert view["ahead_distance"][0, :2] == pytest.approx(distance, abs=1e-2)
    assert view["ahead_distance"][0, 2] == pytest.approx(1000)


def test_swarm_rows_agree_with_the_state() -> None:
    game = started()
    go(game)
    go(game, attack=4, num_steps=40)
    rows = vehicle_fields(game.config).decode(game.team("defender").observe())
    state = game.state
    assert np.allclose(rows["speed"][0], state.speed[0], atol=1e-4)
    assert np.allclose(rows["gap"][0, 1:], -np.diff(state.position[0]), atol=1e-3)
    assert rows["leads"][0].tolist() == ([1] + [0] * 9) * 4
    assert rows["active"][0].tolist() == [0] * 10 + [1] * 30
    own_law = seen(game, "defender")["law_command"][0]
    assert np.allclose(rows["law_command"][0], own_law, atol=1e-4)
    assert np.allclose(rows["predecessor_command"][0, 1:], np.clip(state.command[0, :-1], -5, 1), atol=1e-4)
    assert rows["since_disbanding_s"][0] == pytest.approx([0.0] * 10 + [4.0] * 30, abs=1e-3)
    assert rows["ahead_speed"][0] == pytest.approx([31.0] * 10 + [state.speed[0, 9]] * 30, abs=1e-4)
    assert np.allclose(rows["ahead_distance"][0, 10:], state.position[0, 9] - state.position[0, 10:], atol=1e-2)


def test_local_swarm_rewards_are_the_vehicles_own_errors() -> None:
    game = started(swarm_reward="local")
    team = game.team("defender")
    total = np.zeros((1, 40))
    for step in range(60):
        payoff = go(game, attack=4 if step == 10 else 0, num_steps=1)
        total += team.rewards(payoff)
    share = 100 / (game.config.horizon_steps * 31) / 40
    assert np.allclose(-total, share * game.state.speed_error)


@pytest.mark.parametrize("groups", [40, 4, 1])
@pytest.mark.parametrize("overrides", [{}, {"payoff_set": "intact_now"}, {"on_collision": "end"}])
def test_own_parts_of_the_pay_sum_to_minus_the_payoff(overrides: dict[str, Any], groups: int) -> None:
    crashing = {"tau_s": 0.5, "collision_penalty": 0.3, "swarm_reward": "local", "duration_s": 60.0}
    game = started(seeds=(0, 1), **crashing, **overrides)
    team = grouped(game.team("defender"), tuple(map(str, range(groups))))
    total, paid = np.zeros(groups), 0.0
    for step in range(game.horizon):
        payoff = go(game, attack=4 if step == 10 else 0, num_steps=1)
        rewards = team.rewards(payoff)
        np.testing.assert_allclose(rewards.sum(axis=1), -payoff, rtol=0, atol=1e-12)
        total, paid = total + rewards[0], paid + payoff[0]
    collided = game.state.collided_intact[0]
    assert collided.any()
    assert total.sum() == pytest.approx(-paid)
    own = 0.3 * 100 / 40 * collided.reshape(groups, -1).sum(axis=1)
    assert (-total >= own - 1e-9).all()


def test_groups_of_a_team_are_equally_many() -> None:
    team = started().team("defender")
    with pytest.raises(ConfigurationError, match="cannot be divided"):
        grouped(team, ("a", "b", "c"))
    assert grouped(team, team.agents) is team


def test_privileged_tells_what_episodes_hide() -> None:
    game = started(seeds=(0, 1), preset="learning")
    go(game, num_steps=150)
    for role in ("attacker", "defender"):
        road = game.privileged(role)
        assert road.shape == (2, 5 + 6 * 4)
        assert np.isfinite(road).all()
        assert np.abs(road).max() < 5
    team = game.team("defender")
    own = team.privileged()
    assert own.shape == (2, 40, 23)
    np.testing.assert_allclose(grouped(team, tuple("abcd")).privileged(), own[:, ::10], rtol=1e-5)
    headway = game.state.driver_headway_s.reshape(2, 4, 10).mean(axis=2)
    np.testing.assert_allclose(own[:, ::10, 6], (headway - 1.5) / 0.3, rtol=1e-5)


def test_swarm_needs_vehicle_corrections() -> None:
    with pytest.raises(ConfigurationError, match="defense_action"):
        started(defense_action="platoon").team("defender")


def test_a_fingerprint_tells_games_apart() -> None:
    game = started(seeds=(3,), preset="easy")
    go(game)
    assert game.model(0, 1).fingerprint() == game.fingerprint() != game.model(0, 2).fingerprint()


def test_the_front_of_a_thousand_platoons_drives_like_ten() -> None:
    """The last vehicle of a platoon does not feel who follows, so platoons behind change nothing ahead."""
    overrides = {"vehicles_per_platoon": 3, "attack_budget": 1, "duration_s": 30.0}
    few, many = (started(num_platoons=count, **overrides) for count in (10, 1000))
    for game, attack in ((few, 10), (many, 1000)):
        go(game)
        go(game, attack, num_steps=200)
    for name in ("position", "speed", "speed_error", "stops", "collided"):
        ours, theirs = getattr(many.state, name)[0], getattr(few.state, name)[0]
        np.testing.assert_array_equal(ours[:30], theirs, err_msg=name)
    ours, theirs = seen(many, "defender"), seen(few, "defender")
    np.testing.assert_array_equal(ours["law_command"][0, :30], theirs["law_command"][0])
    np.testing.assert_array_equal(ours["ahead_speed"][0, -9:], theirs["ahead_speed"][0])
    assert many.team("defender").observe().shape[1] == 3000
    assert many.metrics()["velocity_error_all"][0] < few.metrics()["velocity_error_all"][0]


def test_what_is_measured_is_what_the_state_says() -> None:
    game, generator = started(report="full"), np.random.default_rng(0)
    state, size = game.state, game.config.vehicles_per_platoon
    vehicles = state.speed_error.shape[1]
    state.disbanding_s[0, 1:3] = 4.0, 2.5
    state.speed_error[0] = generator.uniform(1, 9, vehicles)
    state.stops[0] = generator.integers(0, 3, vehicles)
    state.collided[0] = generator.random(vehicles) < 0.5
    state.collided_intact[0] = state.collided[0] & (generator.random(vehicles) < 0.5)
    state.intact_error[:], state.noted[:], state.driven_km[:], state.false_alarms[:] = 7.0, 5, 2.0, 3.0
    state.acceleration_squares[:], state.jerk_squares[:], state.work_kj[:], state.disturbed_s[:] = 20.0, 45.0, 6.0, 8.0
    found = measured(state, game.constants, 200)[0]
    intact = np.repeat(np.isinf(state.disbanding_s[0]), size)
    percent = 100 / (200 * game.config.desired_speed_mps)
    assert found["velocity_error_all"] == pytest.approx(percent * state.speed_error[0].mean())
    assert found["velocity_error_intact"] == pytest.approx(percent * state.speed_error[0, intact].mean())
    assert found["velocity_error_intact_now"] == pytest.approx(percent * 7)
    assert (found["collided"], found["collided_intact"]) == (state.collided.sum(), state.collided_intact.sum())
    assert found["stopped_share"] == pytest.approx(100 * (state.stops[0, intact] > 0).mean())
    assert found["false_alarms"] == pytest.approx(100 * 3 * game.constants["period_steps"][0] / 200)
    ride = [found[name] for name in ("acceleration_mps2", "jerk_mps3", "energy_kj_per_km", "recovery_s")]
    assert ride == pytest.approx([2.0, 3.0, 3.0, 5.5])
    state.driven_km[:], state.noted[:] = 0.0, 0
    found = measured(state, game.constants, 200)[0]
    assert found["energy_kj_per_km"] == 0.0
    assert found["jerk_mps3"] == pytest.approx(np.sqrt(45))
    state.disbanding_s[:] = 1.0
    found = measured(state, game.constants, 200)[0]
    assert found["velocity_error_intact"] == found["stopped_share"] == 0.0


@pytest.mark.parametrize("stops", [True, False])
def test_charges_follow_their_formula(stops: bool) -> None:
    game = started(collision_penalty=0.3)
    episode, metrics = view(game.state, 0), records(Metrics, 1).view(np.recarray)
    constants: Any = SimpleNamespace(num_vehicles=40, stop_at_collision=stops)
    rules: Any = SimpleNamespace(collision_penalty=0.3, horizon_steps=200, pays_intact_now=False)
    metrics["velocity_error_all"], metrics["velocity_error_intact_now"] = 3.0, 2.0
    episode.step[0], episode.disbanding_s[1] = 50, 2.0
    assert charge(episode, constants, rules, metrics[0]) == 3.0
    metrics["collided_intact"] = 4
    rules.pays_intact_now = True
    assert charge(episode, constants, rules, metrics[0]) == pytest.approx(2.0 + 0.3 * 100 / 40 * 4 + 75.0 * stops)
    assert (metrics["end_charge"][0], metrics["disbanded_platoons"][0]) == (75.0 * stops, 1)
