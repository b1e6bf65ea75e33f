"""Drivers who take over because of what they see, and an attacker that makes them do so by motion alone."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Array
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.problem import DISBANDING
from tests import episodes

NERVOUS: dict[str, Any] = {"attack": "jolt", "alarming_braking_mps2": 1.5, "reaction_s": 0.7, "duration_s": 20.0}
EVERYBODY = np.ones(1, np.bool_)


def started(preset: str = "paper", seed: int = 0, **overrides: Any) -> DisbandingGame:
    game = episodes.started(DISBANDING, (seed,), preset, **overrides)
    assert isinstance(game, DisbandingGame)
    return game


def jolt(game: DisbandingGame, platoon: int, periods: int = 10) -> None:
    """Wait until attacks are legal, then attack a platoon (1 = rear), and go on."""
    if game.elapsed[0] == 0:
        game.advance({"attacker": np.array([0])}, EVERYBODY, 10)
    game.advance({"attacker": np.array([platoon])}, EVERYBODY, 1)
    game.advance({"attacker": np.array([0])}, EVERYBODY, periods - 1)


def test_a_jolted_vehicle_brakes_for_a_second_and_its_driver_takes_over_after_the_reaction_time() -> None:
    """With a lag of 0.1 s the braking passes 1.5 of 2 m/s2 after 0.14 s, so it is felt at 1.2 s."""
    game = started(**NERVOUS)
    jolt(game, platoon=10, periods=3)
    assert game.state.command[0, 0] == -2.0
    assert game.state.disbanding_s[0, 0] == pytest.approx(1.2 + 0.7)
    assert np.isinf(game.state.disbanding_s[0, 1:]).all()
    assert game.observe("attacker")[0, game.fields["attacker"].slices["disbanded"]].max() == -1.0  # not yet
    jolt(game, platoon=0, periods=7)
    assert game.observe("attacker")[0, game.fields["attacker"].slices["disbanded"]][-1] == 1.0
    assert game.budget[0] == 1


def test_the_attacked_member_is_the_one_that_brakes() -> None:
    game = started(**{**NERVOUS, "attacked_member": 4})
    jolt(game, platoon=9, periods=1)
    assert np.flatnonzero(game.state.jolted_until_s[0]).tolist() == [13]
    assert game.scene(0).jolted == ((9, 4),)


def test_nobody_takes_over_whom_nothing_alarms_and_the_budget_is_spent() -> None:
    game = started(**{**NERVOUS, "alarming_braking_mps2": 4.9, "attack_budget": 12})
    jolt(game, platoon=10, periods=60)
    assert np.isinf(game.state.disbanding_s).all()
    assert game.budget[0] == 11  # jolts are not bounded by the number of platoons
    assert game.metrics()["disbanded_platoons"][0] == 0


def test_the_pause_counts_from_jolt_to_jolt() -> None:
    game = started(**{**NERVOUS, "alarming_braking_mps2": 4.9, "attack_pause_s": 3})
    jolt(game, platoon=10)
    assert not game.action_mask("attacker")[0, 1:].any()  # type: ignore[index]
    game.advance({"attacker": np.array([0])}, EVERYBODY, 20)
    assert game.action_mask("attacker")[0, 1:].all()  # type: ignore[index]


@cache
def watched() -> tuple[DisbandingGame, list[dict[str, Array]]]:
    """An episode of preset `drivers` and its motion at every look of the drivers."""
    names = ("position", "acceleration")
    looks: list[dict[str, Array]] = []
    games: list[DisbandingGame] = []

    def look(game: Any) -> None:
        games[:] = [game]
        looks.append({name: getattr(game.state, name)[0].copy() for name in names})

    config = DISBANDING.config("drivers", {"duration_s": 60.0})
    play_episodes(DISBANDING, config, {"attacker": "shake", "defender": "string"}, [3], on_step=look)
    return games[0], looks


def test_takeovers_are_those_of_a_plain_loop_over_the_motion() -> None:
    game, looks = watched()
    s, size = game.state, game.config.vehicles_per_platoon
    expected, before = np.full(game.config.max_platoons, np.inf), looks[0]["acceleration"]
    for k, seen in enumerate(looks[:-1]):  # what is seen in the end is not looked at any more
        time_s, acceleration = 0.1 * k, seen["acceleration"]
        gap = np.concatenate([[np.inf], -np.diff(seen["position"])])
        braking = -acceleration > s.alarming_braking_mps2[0]
        jerk = np.abs(acceleration - before) / 0.1 > s.alarming_jerk_mps3[0]
        for q in np.flatnonzero(braking | jerk | (gap < s.alarming_gap_m[0])):
            if time_s < expected[q // size] - 1e-9:
                expected[q // size] = min(expected[q // size], time_s + s.reaction_s[0, q])
        before = acceleration
    assert np.isfinite(expected).sum() >= 2  # a jolt, and a wave behind it
    np.testing.assert_allclose(s.disbanding_s[0], expected, atol=1e-9)


def test_limits_and_reaction_times_are_drawn_for_each_driver() -> None:
    state = started("drivers", seed=1).state
    for values, low, high in (
        (state.alarming_braking_mps2, 2.5, 4.5),
        (state.alarming_jerk_mps3, 30, 60),
        (state.alarming_gap_m, 1.0, 2.5),
        (state.reaction_s, 0.5, 1.5),
    ):
        assert low <= values.min() < values.mean() < values.max() <= high
        assert values.mean() == pytest.approx((low + high) / 2, rel=0.1)
        assert len(np.unique(values)) == 100


def test_a_jolt_that_is_softer_than_every_limit_disbands_platoons_behind() -> None:
    """A second of 2 m/s2 alarms nobody by itself, repeated it alarms the front platoon, and the wave all others."""
    config = DISBANDING.config("drivers", {})
    metrics = play_episodes(DISBANDING, config, {"attacker": "lead", "defender": "none"}, [0, 1])
    assert config.jolt_mps2 < config.alarming_braking_mps2[0]
    assert metrics["disbanded_platoons"].tolist() == [10, 10]
    calm = play_episodes(DISBANDING, config, {"attacker": "none", "defender": "none"}, [0, 1])
    assert calm["disbanded_platoons"].tolist() == [0, 0]


def test_calm_brakes_below_every_limit_and_saves_platoons() -> None:
    """Against the same attacks fewer platoons disband than behind `string`, which acts from the start on as well."""
    config = DISBANDING.config("drivers", {"duration_s": 120.0})
    disbanded = {
        defender: play_episodes(DISBANDING, config, {"attacker": "shake", "defender": defender}, [0, 1, 2])
        for defender in ("none", "string?detection_mps=0", "calm")
    }
    none, string, calm = (found["disbanded_platoons"].mean() for found in disbanded.values())
    assert calm < string < none
    assert disbanded["calm"]["velocity_error_all"].mean() < disbanded["none"]["velocity_error_all"].mean()


@pytest.mark.parametrize(("role", "reference"), [("attacker", "shake"), ("defender", "calm")])
def test_both_refuse_roads_on_which_no_driver_watches(role: Any, reference: str) -> None:
    with pytest.raises(ConfigurationError, match="drivers"):
        resolve_policy(reference, episodes.spec_of(DISBANDING, role, "paper"))


def test_without_them_nothing_is_kept_of_drivers() -> None:
    state = started().state
    assert state.reaction_s.shape == state.jolted_until_s.shape == (1, 0)
