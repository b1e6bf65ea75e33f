"""The roles of HVAC as teams: what each sensor's agent is paid, and what critics are told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.types import ROLES, Array, Role
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.game import HvacGame
from tests.hvac.games import go, started

ATTACKED = {"num_steps": 90, "window_steps": 40, "onset_step": 45, "preset": "learning", "compromised_weights": (0, 1)}


def attacked(choice: int = 30, num_steps: int = 30, **overrides: Any) -> tuple[HvacGame, Array]:
    """Games after some steps of attack, and the payoff of the last step."""
    game = started(range(4), **{**ATTACKED, **overrides})
    attack = absolute_action(game.config, np.full((1, 1), 12.0))[0]
    go(game, 0, attack, 50)
    go(game, choice, attack, num_steps)
    return game, go(game, choice, attack)


@pytest.mark.parametrize("overrides", [{}, {"payoff": "discomfort"}, {"num_sensors": 8}])
def test_parts_of_the_defenders_sum_to_minus_the_payoff(overrides: dict[str, Any]) -> None:
    game, payoff = attacked(1, **overrides)
    parts = game.team("defender").rewards(payoff)
    assert parts.shape == (4, game.config.num_sensors)
    assert (parts <= 0).all()
    assert payoff.max() > 0
    np.testing.assert_allclose(parts.sum(axis=1), -payoff, rtol=1e-12)


def test_each_defender_pays_for_the_zone_of_its_sensor() -> None:
    game, payoff = attacked()
    errors = game.state.temperature - game.config.reference_c
    parts = game.team("defender").rewards(payoff)
    np.testing.assert_allclose(parts, -(errors**2) / (90 - 45), rtol=1e-9)


def test_a_house_without_any_error_is_shared_equally() -> None:
    game = started(**ATTACKED)
    game.state.temperature[:] = game.config.reference_c
    assert game.team("defender").rewards(np.ones(1)).tolist() == [[-0.25] * 4]


def test_each_liar_is_paid_all() -> None:
    game, payoff = attacked()
    np.testing.assert_array_equal(game.team("attacker").rewards(payoff), np.stack([payoff] * 4, axis=1))


@pytest.mark.parametrize("role", ROLES)
def test_critics_are_told_finite_numbers_of_about_unit_size(role: Role) -> None:
    game, _ = attacked(1)
    told = game.team(role).privileged()
    assert told.shape[:2] == (4, 4)
    assert told.dtype == np.float32
    assert (np.abs(told) <= 5).all()
    assert (told != 0).any(axis=(0, 1)).all()


@pytest.mark.parametrize("role", ROLES)
def test_a_role_of_one_agent_is_told_the_mean_of_its_team(role: Role) -> None:
    game, _ = attacked(1)
    np.testing.assert_allclose(game.privileged(role), game.team(role).privileged().mean(axis=1), rtol=1e-6)


def test_critics_of_the_attacker_are_told_whom_the_defender_believes() -> None:
    for choice, used in ((1, [0, 0, 0, 1]), (8, [1, 0, 0, 0]), (15, [0] * 4), (30, [1] * 4), (31, [0] * 4)):
        game, _ = attacked(choice, 1)
        assert game.team("attacker").privileged()[0, :, 0].tolist() == used


def test_critics_of_the_defender_are_told_who_lies_from_the_onset_on() -> None:
    game = started(range(4), **ATTACKED)
    go(game, 0, num_steps=40)
    assert not game.team("defender").privileged()[..., 0].any()
    go(game, 0, num_steps=10)
    np.testing.assert_array_equal(game.team("defender").privileged()[..., 0], game.state.compromised)
