"""The defender that tries its choices on copies of the episode: what it knows, and that nobody told less pays less."""

from __future__ import annotations

import numpy as np
import pytest

from cps_baselines.hvac.lookahead import Lookahead, go_on
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import policy_names, resolve_policy
from cps_envs.hvac.game import HvacGame
from tests.hvac.games import go, play, spec_of, started

CHOICES = 32
SHORT = {"num_steps": 280, "window_steps": 200, "onset_step": 210}
ATTACK_FREE, DAYS = {"compromised_weights": (1,)}, range(700_000, 700_100)


def at_noon(num_steps: int = 230) -> HvacGame:
    game: HvacGame = started([3], preset="learning", onset_step=205, compromised_weights=(0, 0, 1))
    go(game, 15, [0.1] * 4 + [-1.0], num_steps)
    return game


def best(game: HvacGame) -> int:
    return Lookahead(game.spec("defender"))._best(game.model(0, CHOICES))


def test_what_is_to_come_changes_no_choice() -> None:
    game = at_noon()
    chosen, k = best(game), int(game.state.step[0])
    for course in (game.state.series, game.state.heat_drift, game.state.outdoor_error):
        course[:, k + 1 :] += 50.0
    assert best(game) == chosen


def test_liars_go_on_as_they_are() -> None:
    game = at_noon()
    copies = game.model(0, CHOICES)
    copies.advance({"attacker": go_on(copies), "defender": np.arange(CHOICES)}, np.ones(CHOICES, bool), 1)
    zone, lying = copies.constants.zone, game.state.compromised[0]
    shown = (copies.state.reading - copies.state.temperature[:, zone])[:, lying]
    now = (game.state.reading - game.state.temperature[:, zone])[:, lying]
    np.testing.assert_allclose(shown, np.broadcast_to(now, shown.shape), atol=1e-9)
    assert (copies.state.onset == 0).all()


def test_before_the_onset_nobody_lies_in_the_copies() -> None:
    game = at_noon(202)
    copies = game.model(0, CHOICES)
    go_on(copies)
    assert not copies.state.compromised.any()
    assert game.state.compromised.any()  # the episode itself stays as it is


def test_it_holds_the_choice_that_pays_least() -> None:
    game = at_noon()
    copies = game.model(0, CHOICES)
    payoff = copies.advance({"attacker": go_on(copies), "defender": np.arange(CHOICES)}, np.ones(CHOICES, bool), 20)
    assert payoff[best(game)] == payoff.min() < payoff.max()


def test_it_says_what_it_is_told() -> None:
    policy = resolve_policy("lookahead", spec_of("defender"))
    assert policy.privileged == {"model"}
    with pytest.raises(TypeError, match="model"):
        policy.predict(np.zeros((1, policy.spec.fields.size), np.float32))
    with pytest.raises(ConfigurationError, match="hold_steps = 0"):
        Lookahead(spec_of("defender"), hold_steps=0)


@pytest.mark.parametrize("action", ["any", "bias"])
def test_it_plays_to_the_end_with_either_attack(action: str) -> None:
    found = play("ramp?keep_noise=true", "lookahead", [1], "learning", attack_action=action, **SHORT)
    assert np.isfinite(found["return"]).all()


@pytest.mark.slow
def test_no_other_defender_pays_less_without_an_attack() -> None:
    """On 100 days: `truth` and `informed`, which are told, and every registered, searched or trained defender."""
    told = play("none", "lookahead", DAYS, "learning", **ATTACK_FREE)["return"]
    unnamed = {"always", "mixture", "mtd2_calibrated", "lookahead"}  # the first need options, or a shipped threshold
    others = {*policy_names("hvac", "defender"), "zoo:hvac-defense", "zoo:hvac-defense-self-play"} - unnamed
    for name in sorted(others):
        paid = play("none", name, DAYS, "learning", **ATTACK_FREE)["return"]
        assert told.mean() < paid.mean(), name
