"""The defence as a team of vehicles: what each is charged for, and what value functions may be told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.types import Array
from cps_envs.rogue.game import RogueGame
from tests.rogue.games import FIXED, started

ROUGH: dict[str, Any] = {"onset_s": (0.0, 2.0), "duration_s": 20.0}


def drive(game: RogueGame, decisions: int, num_steps: int = 1) -> Any:
    """Payoffs (B,) and the team's rewards (B, k) of decisions under random efforts and orders."""
    generator, team = np.random.default_rng(3), game.team("defender")
    everyone = np.ones(game.num_envs, bool)
    for _ in range(decisions):
        efforts = generator.choice([-1.0, 1.0], (game.num_envs, 1))
        orders = np.stack([game.action_space["defender"].sample() for _ in everyone])
        payoff = game.advance({"attacker": efforts, "defender": orders}, everyone, num_steps)
        yield payoff, team.rewards(payoff)


@pytest.mark.parametrize(
    "setting",
    [
        {"preset": "learning"},
        {"preset": "easy"},
        {"preset": "easy", "defense_action": "command", "contact": "pass"},
    ],
)
def test_the_rewards_of_all_sum_to_minus_the_payoff(setting: dict[str, Any]) -> None:
    game = started(range(30), **setting, **ROUGH)
    total = 0.0
    for payoff, rewards in drive(game, 40, num_steps=5):
        assert rewards.shape == (30, game.config.num_orders)
        np.testing.assert_allclose(rewards.sum(axis=1), -payoff, atol=1e-9)
        total += payoff.sum()
    assert game.metrics()["damage"].sum() > 0
    assert total == pytest.approx(sum(game.metrics()[part].sum() for part in game.payoff_parts))


def test_rewards_go_on_after_an_episode_has_started_anew() -> None:
    game = started(range(4), "learning", **ROUGH)
    team, everyone = game.team("defender"), np.ones(4, bool)
    for episode in range(2):
        payoff = np.zeros(4)
        for _ in range(3 + episode):
            payoff += game.advance({"attacker": np.ones((4, 1))}, everyone, 40)
        np.testing.assert_allclose(team.rewards(payoff).sum(axis=1), -payoff, atol=1e-9)
        game.reset(everyone, [np.random.default_rng(seed) for seed in range(4)])


def charges(game: RogueGame, pair: int, payoff: float) -> Array:
    """What each vehicle is charged for 4 m/s of damage of a pair, and for the rest of a payoff."""
    team = game.team("defender")
    game.state.damage[0, pair] += 4.0
    charged: Array = -team.rewards(np.array([payoff]))[0]
    return charged


def test_damage_is_charged_to_the_pair_and_leaving_to_all() -> None:
    game = started((0,), "learning", **FIXED, onset_s=30.0)
    assert charges(game, 0, 4.0) == pytest.approx([2, 2, 0, 0, 0])
    assert charges(game, 1, 4.0 + 5.0) == pytest.approx([1, 3, 3, 1, 1])


def test_the_seized_vehicle_is_charged_nothing_once_it_is_driven() -> None:
    game = started((0,), "learning", **FIXED, onset_s=0.0)
    assert charges(game, 1, 4.0) == pytest.approx([0, 4, 0, 0, 0])
    assert charges(game, 2, 4.0 + 4.0) == pytest.approx([1, 1, 0, 5, 1])
    marked = started((0,), "easy", onset_s=5.0)
    assert charges(marked, 2, 4.0 + 4.0) == pytest.approx([1, 1, 5, 1])


def test_vehicles_that_an_episode_lacks_are_charged_nothing() -> None:
    game = started(range(20), "learning", **ROUGH)
    lacking = np.arange(8) >= game.drawn["num_vehicles"][:, np.newaxis]
    for _, rewards in drive(game, 40, num_steps=5):
        assert not rewards[lacking].any()


def test_value_functions_are_told_numbers_of_about_unit_size() -> None:
    game = started(range(50), "learning", **ROUGH)
    for _ in drive(game, 30, num_steps=5):
        told = [game.privileged("attacker"), game.privileged("defender"), game.team("defender").privileged()]
        assert [each.shape for each in told] == [(50, 16), (50, 9), (50, 8, 13)]
        assert all(np.isfinite(each).all() and np.abs(each).max() < 5 for each in told)
    assert all(each.reshape(-1, each.shape[-1]).std(axis=0).max() > 0.3 for each in told)


def test_value_functions_are_told_who_is_seized() -> None:
    game = started(range(50), "learning", onset_s=0.0)
    seized = game.team("defender").privileged()[..., -3]
    assert np.array_equal(seized.argmax(axis=1), game.drawn["attacker"])
    assert np.array_equal(seized.sum(axis=1), np.ones(50))
    assert game.privileged("defender")[:, -1] * 8 == pytest.approx(game.drawn["attacker"])
    attacked = game.drawn["onset_step"] == 0
    assert np.array_equal(game.privileged("defender")[:, 0], attacked)
    assert game.team("defender").privileged().shape[1] == 8
    assert started((0,), "easy").team("defender").privileged().shape == (1, 4, 13)
