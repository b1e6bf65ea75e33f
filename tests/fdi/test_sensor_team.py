"""The defence as a team of sensors: what each sees and does, what each is charged for, what a critic may be told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.fdi.adapters.sensor import Sensor
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.problem import FDI
from tests.episodes import seen_by
from tests.fdi.episodes import advance, levels, place, spec_of, started

NAMES = ("front_1", "front_2", "front_3", "front_4", "rear_2", "rear_3", "rear_4")
GAPS = np.array([0, 1, 2, 3, 0, 1, 2])


def shown_to(game: FdiGame) -> dict[str, Array]:
    adapter = Sensor(game.spec("defender"))
    return adapter.fields.decode(adapter.observe(seen_by(game, adapter), ()))


def ended(num_envs: int, seed: int, doubt: float, **overrides: Any) -> tuple[FdiGame, list[Array], list[Array]]:
    """Whole episodes under loud lies and random doubts: the game, payoffs (steps, B), rewards (steps, B, 7)."""
    game = started(num_envs, seed, attack_share=1.0, onset_s=0.0, **overrides)
    team, generator = game.team("defender"), np.random.default_rng(seed)
    readings, paid, own = 14, [], []
    while not (game.terminated | (game.elapsed >= game.horizon)).all():
        defence = np.repeat(game.neutral_action["defender"][np.newaxis], num_envs, axis=0)
        defence[:, :readings] = generator.random((num_envs, readings)) >= doubt
        defence[:, readings:] = generator.integers(0, 9, (num_envs, 4))
        attack = np.full((num_envs, readings), 40)
        payoff = game.advance({"attacker": attack, "defender": defence}, ~game.terminated, 1)
        paid.append(payoff)
        own.append(team.rewards(payoff))
    return game, paid, own


@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.1, 0.5]), st.sampled_from(["any", "target"]))
@settings(max_examples=15)
def test_what_the_sensors_are_paid_sums_to_minus_the_payoff(seed: int, doubt: float, pair: str) -> None:
    _, paid, own = ended(8, seed, doubt, paid_pair=pair)
    np.testing.assert_allclose(np.sum(own, axis=2), -np.array(paid), rtol=1e-12, atol=1e-12)


def test_an_impact_is_paid_by_the_sensors_of_its_gap() -> None:
    game, _, own = ended(64, 1, 0.0, tasks="xv2>2 v1+rv2>1", correction_cost=0.0)
    hit = 0
    for b in range(64):
        impact = game.episode_metrics(b)["worst_impact_mps"]
        total = np.sum(own, axis=0)[b]
        if impact > 0:
            hit += 1
            (gap,) = set(GAPS[total < -1e-9].tolist())
            assert -game.state.error[b, 4 + gap] == pytest.approx(impact)
            assert total[gap == GAPS] == pytest.approx(-impact / np.sum(gap == GAPS))
    assert hit > 30


def test_a_sensor_is_charged_for_its_own_doubts_and_for_what_its_vehicle_brakes() -> None:
    game = started(1, attack_share=0.0)
    team, defence = game.team("defender"), game.neutral_action["defender"].copy()
    defence[[place("x2"), place("v2"), place("rv3")]] = 0
    payoff = game.advance({"defender": defence[np.newaxis]}, np.ones(1, np.bool_), 1)
    expected = np.zeros(7)
    expected[[1, 5]] = [-0.002, -0.001]  # 0.01 m/s2 for 0.1 s each
    np.testing.assert_allclose(team.rewards(payoff)[0], expected, atol=1e-15)
    defence[-1] = 0  # the most that vehicle 4 can brake more: 2 m/s2, of four vehicles
    payoff = game.advance({"defender": defence[np.newaxis]}, np.ones(1, np.bool_), 1)
    expected[3] -= 0.01 * 0.1 * 2 / 4
    np.testing.assert_allclose(team.rewards(payoff)[0], expected, atol=1e-15)


def test_held_actions_are_charged_for_every_step() -> None:
    game = started(1, attack_share=0.0)
    defence = game.neutral_action["defender"].copy()
    defence[place("x2")] = 0
    payoff = game.advance({"defender": defence[np.newaxis]}, np.ones(1, np.bool_), 3)
    assert game.team("defender").rewards(payoff)[0, 1] == pytest.approx(-0.003)


def test_beliefs_become_the_action_of_the_role() -> None:
    adapter = Sensor(spec_of("defender", preset="learning"))
    assert adapter.agents == NAMES
    actions = np.repeat(adapter.neutral_action[np.newaxis], 7, axis=0)[np.newaxis]
    actions[0, 1, 0] = actions[0, 5, 1] = 0
    actions[0, [0, 3, 6], 2] = 1, 2, 2  # that of a rear sensor does nothing
    native, _ = adapter.act(seen_by(started(), adapter), (), actions)
    doubted = np.flatnonzero(native[0, :14] == 0)
    assert doubted.tolist() == [place("x2"), place("rv3")]
    assert native[0, 14:].tolist() == [2, 4, 4, 0]
    assert FDI.presets["learning"].num_readings == 14


def test_a_sensor_sees_innovations_in_deviations_and_those_of_its_partner() -> None:
    game = started(6, 3, attack_share=0.0)
    for _ in range(20):
        advance(game)
    decoded = game.fields["defender"].decode(game.observe("defender"))
    ranges = decoded["range_innovation"] / decoded["range_deviation"]
    rates = decoded["rate_innovation"] / decoded["rate_deviation"]
    shown = shown_to(game)
    np.testing.assert_allclose(shown["range_z"], ranges.clip(-3, 3), atol=1e-5)
    np.testing.assert_allclose(shown["rate_z2"], np.square(rates).clip(0, 10), atol=1e-5)
    partners = [4, 5, 6, -1, 0, 1, 2]
    for agent, partner in enumerate(partners):
        expected = rates[:, partner].clip(-3, 3) if partner >= 0 else 0.0
        np.testing.assert_allclose(shown["partner_rate_z"][:, agent], expected, atol=1e-5)
    np.testing.assert_allclose(
        shown["worst_range_z"], np.abs(ranges).max(1).clip(0, 3)[:, None].repeat(7, 1), atol=1e-5
    )
    assert shown["alone"].tolist() == [[0, 0, 0, 1, 0, 0, 0]] * 6
    assert shown["rear"].tolist() == [[0, 0, 0, 0, 1, 1, 1]] * 6
    np.testing.assert_allclose(shown["gap"], np.tile(GAPS, (6, 1)), atol=1e-6)
    np.testing.assert_allclose(
        0.1 * np.sinh(shown["predicted_gap_error"]), decoded["predicted_gap_error"][:, GAPS], atol=1e-4
    )


def test_a_sensor_sees_the_gaps_beside_it_and_the_platoon() -> None:
    game = started(6, 3, attack_share=0.0)
    for _ in range(20):
        advance(game)
    decoded = game.fields["defender"].decode(game.observe("defender"))
    rates = decoded["rate_innovation"] / decoded["rate_deviation"]
    means = np.stack([rates[:, gap == GAPS].mean(axis=1) for gap in range(4)], axis=1)
    shown = shown_to(game)
    beside = np.pad(means, ((0, 0), (1, 1))).clip(-2, 2)
    np.testing.assert_allclose(shown["ahead_rate_z"], beside[:, GAPS + 2], atol=1e-5)
    np.testing.assert_allclose(shown["behind_rate_z"], beside[:, GAPS], atol=1e-5)
    platoon = (-means @ [1, 2, 3, 4] / np.sqrt(30)).clip(-2, 2)
    np.testing.assert_allclose(shown["platoon_rate_z"], np.tile(platoon[:, np.newaxis], 7), atol=1e-5)


def test_a_sensor_sees_whether_it_was_used() -> None:
    game, defence = started(1), spec_of("defender", preset="learning").neutral_action.copy()
    defence[place("v1")] = 0
    advance(game, defense=defence)
    shown = shown_to(game)
    assert shown["rate_used"].tolist() == [[0, 1, 1, 1, 1, 1, 1]]
    assert shown["range_used"].tolist() == [[1] * 7]


def test_critics_are_told_who_lies_and_what_is_true() -> None:
    game = started(2, tasks="xv3+rv4>3", attack_share=1.0, onset_s=0.0)
    advance(game, levels(game, {"x3": 6, "v3": 4, "rv4": 4}))
    told = game.team("defender").privileged()
    assert told.shape == (2, 7, 11)
    np.testing.assert_allclose(told[:, :, 0], game.state.error[:, GAPS] / 3, atol=1e-6)
    assert told[0, :, 2].tolist() == [0, 0, 1, 0, 0, 0, 0]  # 3 m
    assert told[0, :, 3].tolist() == [0, 0, 0.5, 0, 0, 0, 0.5]  # 1 m/s
    assert told[0, :, 4].tolist() == [0, 0, 1, 0, 0, 0, 0]
    assert told[0, :, 5].tolist() == [0, 0, 1, 0, 0, 0, 1]
    assert told[0, :, 6].tolist() == [1] * 7
    assert game.privileged("defender").shape == (2, 8 + 28 + 1)
    quiet = started(2, attack_share=0.0)
    assert not quiet.team("defender").privileged()[:, :, 6:8].any()


def test_the_attackers_critic_is_told_the_disturbances_of_now_and_next() -> None:
    game = started(3)
    for _ in range(12):
        advance(game)
    told = game.privileged("attacker")
    for b, phases in enumerate(game.state.phase):
        blocks = [(12 + phase) // 10 for phase in phases]
        now_and_next = [[game.state.disturbance[b, block + k, i] for i, block in enumerate(blocks)] for k in (0, 1)]
        np.testing.assert_allclose(told[b], np.ravel(now_and_next) / 0.5, atol=1e-6)
    assert started(2, disturbance_mps2=0.0).privileged("attacker").shape == (2, 0)


@pytest.mark.parametrize("overrides", [{"preset": "paper"}, {"preset": "learning", "goal": "instability"}])
def test_sensors_share_impacts_behind_a_filter_only(overrides: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match='goal = "collision"'):
        Sensor(spec_of("defender", **overrides))
    with pytest.raises(ConfigurationError, match="team of sensors"):
        started(goal="instability").team("defender")


def test_the_attacker_is_no_team_and_neither_is_a_defender_without_a_filter() -> None:
    with pytest.raises(TypeError, match="no decentralised form"):
        started().team("attacker")
    with pytest.raises(TypeError, match="no decentralised form"):
        FdiGame(FDI.presets["paper"], 1).team("defender")
