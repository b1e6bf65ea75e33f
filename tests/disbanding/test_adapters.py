"""What learners play disbanding through."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.adapters import STEPS, Follow, FollowRoad, Vehicle
from cps_envs.disbanding.follower import PLAIN, UNIT, SetPoints, set_points
from tests.disbanding.rounds import game_of, played, started_match
from tests.episodes import seen_by


def neutral(adapter: Adapter, count: int) -> FloatArray:
    return np.broadcast_to(adapter.neutral_action, (count, len(adapter.agents), *adapter.neutral_action.shape))


@pytest.mark.slow
def test_the_plain_follower_is_far_better_than_nothing() -> None:
    (paid, found), (without, _) = (
        played(defender=each, count=12) for each in ("always?adapter=follow&action=0", "none")
    )
    assert (paid - without).mean() < -8
    assert found["collided_intact"].mean() < 0.2


def test_rows_of_platoons_tell_what_their_vehicles_do() -> None:
    game = game_of(3)
    match = started_match(game, attacker="spread")
    match.step({}, np.ones(3, np.bool_), 900)
    adapter, state = Follow(game.spec("defender")), game.state
    now = seen_by(game, adapter)
    rows = adapter.fields.decode(adapter.observe(now, ()))
    speed = state.speed.reshape(3, 10, 10)
    gaps = -np.diff(state.position.reshape(3, 10, 10), axis=2)
    np.testing.assert_allclose(rows["mean_speed"], speed.mean(axis=2), atol=1e-3)
    np.testing.assert_allclose(rows["min_speed"], speed.min(axis=2), atol=1e-3)
    np.testing.assert_allclose(rows["speed_ahead"][:, 1:], speed.mean(axis=2)[:, :-1], atol=1e-3)
    slowest = np.minimum.accumulate(speed.min(axis=2), axis=1)
    np.testing.assert_allclose(rows["slowest_ahead"][:, 1:], slowest[:, :-1], atol=1e-3)
    np.testing.assert_allclose(rows["slowest_behind"][:, 0], speed[:, 1:].min(axis=(1, 2)), atol=1e-3)
    np.testing.assert_allclose(rows["mean_gap"], np.clip(gaps.mean(axis=2), 4, 18), atol=1e-3)
    np.testing.assert_allclose(rows["warned"][:, 1:], now["warned"].reshape(3, 9, 10).mean(axis=2), atol=1e-6)
    np.testing.assert_allclose(rows["time_left_s"], 90, atol=1e-3)
    disbanded = np.isfinite(state.disbanding_s)
    assert disbanded.any()
    assert np.array_equal(adapter.active(now, ()), ~disbanded)


def test_a_correction_is_that_of_the_formula() -> None:
    game = game_of(2)
    started_match(game, attacker="lead").step({}, np.ones(2, np.bool_), 800)
    adapter = Follow(game.spec("defender"))
    now = seen_by(game, adapter)
    actions = np.random.default_rng(0).uniform(-0.4, 0.4, (2, 10, 22))
    found, _ = adapter.act(now, (), actions)
    for b, q in ((0, 37), (0, 50), (1, 99)):
        values = (PLAIN + STEPS * actions[b, q // 10].reshape(2, 11) * np.array(UNIT))[0 if q % 10 == 0 else 1]
        g = SetPoints(*values)
        speed, own = now["speed"][b, q], now["acceleration"][b, q]
        excess = now["gap"][b, q - 1] - g.wanted_m - g.headway_s * speed
        wanted = g.gap * np.clip(excess, -10, 10) + g.closing * now["relative_speed"][b, q - 1]
        wanted += g.predecessor * now["acceleration"][b, q - 1]
        if now["warned"][b, q - 10] > 0.5:
            told = g.ahead_closing * (now["ahead_speed"][b, q - 10] - speed)
            told += g.ahead_command * now["ahead_command"][b, q - 10]
            wanted += told / (1 + 0.2 * now["record_age_s"][b, q - 10])
        silent = now["silence_s"][b, : q // 10 * 10 : 10].max()
        wanted -= g.silence * (np.clip(silent, 1, 5) - 1)
        command = min(wanted + g.lead * (wanted - own), g.cap * (31.5 - speed))
        correction = command - (1 - g.law) * now["law_command"][b, q]
        assert found[b, q] == pytest.approx(np.clip(correction / 6, -1, 1), abs=1e-5)


def test_zero_is_the_plain_follower() -> None:
    table = set_points(np.zeros((1, 22)), STEPS)
    assert [tuple(row) for row in table.tolist()] == [tuple(row) for row in PLAIN.tolist()]


def test_one_agent_for_the_road_is_every_platoon_alike() -> None:
    game = game_of(4)
    started_match(game, attacker="spread").step({}, np.ones(4, np.bool_), 600)
    road, platoons = FollowRoad(game.spec("defender")), Follow(game.spec("defender"))
    now, actions = seen_by(game, road), np.random.default_rng(1).uniform(-1, 1, (4, 1, 22))
    together, _ = road.act(now, (), actions)
    apart, _ = platoons.act(now, (), np.repeat(actions, 10, axis=1))
    assert np.array_equal(together, apart)


@pytest.mark.parametrize(
    "overrides",
    [
        {"preset": "paper"},
        {"preset": "easy", "num_platoons": (3, 6)},
        {"preset": "learning", "num_platoons": (4, 6)},
        {"preset": "paper", "correctable": "intact", "tau_s": 0.5},
    ],
)
def test_platoons_of_every_configuration_follow(overrides: dict[str, Any]) -> None:
    game = game_of(3, **overrides)
    started_match(game, attacker="lead").step({}, np.ones(3, np.bool_), 700)
    adapter = Follow(game.spec("defender"))
    now = seen_by(game, adapter)
    rows, active = adapter.observe(now, ()), adapter.active(now, ())
    corrections, _ = adapter.act(now, (), neutral(adapter, 3))
    present = np.arange(game.config.max_platoons) < (game.constants["num_vehicles"] // 10)[:, np.newaxis]
    intact = present & ~np.isfinite(game.state.disbanding_s)
    disbanded_ahead = np.maximum.accumulate(np.isfinite(game.state.disbanding_s), axis=1)
    expected = intact if game.config.correctable == "intact" else intact & disbanded_ahead
    assert np.array_equal(active, expected)
    assert not rows[~present].any()
    assert (np.abs(corrections).reshape(3, -1, 10).max(axis=2) > 0)[active].all()
    assert not np.abs(corrections).reshape(3, -1, 10).max(axis=2)[~active].any()
    told = adapter.fields.decode(rows)["warned"]
    assert told[active].max() == 1


def test_vehicles_act_and_see_for_themselves() -> None:
    game = game_of(2)
    started_match(game, attacker="spread").step({}, np.ones(2, np.bool_), 600)
    adapter = Vehicle(game.spec("defender"))
    now = seen_by(game, adapter)
    assert np.array_equal(adapter.observe(now, ()), game.team("defender").observe())
    assert np.array_equal(adapter.active(now, ()), now["mitigable"] > 0.5)
    actions = np.random.default_rng(0).uniform(-1, 1, (2, 100, 1))
    assert np.array_equal(adapter.act(now, (), actions)[0], actions[:, :, 0])
    with pytest.raises(TypeError, match="local"):
        adapter.observe(Seen(now.fields, now.observation), ())


@pytest.mark.parametrize("kind", [Follow, FollowRoad, Vehicle])
def test_adapters_correct_vehicles_only(kind: type[Adapter]) -> None:
    with pytest.raises(ConfigurationError, match="defense_action"):
        kind(game_of(1, defense_action="platoon").spec("defender"))
