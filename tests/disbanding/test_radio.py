"""The warning on its way from vehicle to vehicle: who knows what, and since when."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.types import Array
from cps_envs.disbanding.fields import vehicle_fields
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.problem import DISBANDING
from tests import episodes
from tests.disbanding.rounds import go

PLATOONS, SIZE, ATTACK_S = 4, 10, 1.0
EXACT = {"num_platoons": PLATOONS, "duration_s": 30.0, "warning": "relayed", "correctable": "intact"}
JAM = PLATOONS - 1  # + i: the action that blocks the link behind platoon i


started = partial(episodes.started, DISBANDING, **EXACT)


def warning_times(game: DisbandingGame, attacks: dict[float, int], seconds: int) -> Array:
    """When each vehicle is first warned (B, M) s, +inf if never; `attacks` {second: action}. Seen every 0.1 s."""
    found = np.full(game.state.record_s.shape, np.inf)
    for step in range(10 * seconds):
        go(game, attacks.get(step / 10, 0), num_steps=1)
        told = game.fields["defender"].decode(game.observe("defender"))["warned"] > 0.5
        told = np.pad(told, ((0, 0), (SIZE, 0)))  # the front platoon is never told
        found = np.where(told & np.isinf(found), (step + 1) / 10, found)
    return found


@pytest.mark.parametrize("hop_s", [0.1, 0.3])
def test_without_loss_the_warning_goes_one_vehicle_per_hop(hop_s: float) -> None:
    times = warning_times(started(hop_delay_s=hop_s), {ATTACK_S: 3}, 20)[0]
    assert np.isinf(times[:20]).all()  # the front platoon, and the disbanded one
    ticks = np.floor(ATTACK_S / hop_s + 1e-9) + 1 + np.arange(20)  # messages are sent at multiples of the hop
    np.testing.assert_allclose(times[20:], ticks * hop_s, atol=1e-9)


def test_a_record_is_the_state_of_the_disbanded_vehicle_when_it_was_taken() -> None:
    game, history = started(hop_delay_s=0.2), {}
    for step in range(80):
        go(game, attack=4 if step == 10 else 0, num_steps=1)
        state = game.state
        moment = state.position[0, 9], state.speed[0, 9], state.acceleration[0, 9], state.command[0, 9]
        history[(step + 1) * 10] = np.array(moment)
    rows = vehicle_fields(game.config).decode(game.team("defender").observe())
    for q in range(10, 40):
        if rows["warned"][0, q] > 0.5:
            stamp_s = 8.0 - rows["record_age_s"][0, q]
            assert stamp_s == pytest.approx(8.0 - 0.2 * (q - 9), abs=1e-3)
            taken = history[round(100 * stamp_s)]
            assert rows["ahead_speed"][0, q] == pytest.approx(taken[1], abs=1e-3)
            assert rows["ahead_acceleration"][0, q] == pytest.approx(np.clip(taken[2], -5, 1), abs=1e-3)
            assert rows["ahead_command"][0, q] == pytest.approx(np.clip(taken[3], -11, 7), abs=1e-3)
            distance = np.clip(taken[0] - game.state.position[0, q], 0, 1000)
            assert rows["ahead_distance"][0, q] == pytest.approx(distance, abs=1e-2)
    assert rows["warned"][0].sum() == 30


@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_a_lost_message_is_sent_again_after_a_hop(loss: float) -> None:
    times = warning_times(started(range(60), hop_loss=loss), {ATTACK_S: 4}, 12)
    hops = (times[:, 10:] - ATTACK_S) / 0.1
    assert np.isfinite(hops).all()
    assert (np.diff(hops, axis=1) > 0.5).all()  # never two links at a time
    # Each link takes a geometric number of messages; the mean over 60 episodes of the 30th vehicle.
    deviation = np.sqrt(30 * loss / (1 - loss) ** 2 / 60)
    assert abs(hops[:, -1].mean() - 30 / (1 - loss)) < 4 * deviation
    assert hops[:, -1].std() > 0.5


@given(st.integers(2, 4), st.integers(1, 5))
@settings(max_examples=8, deadline=None)
def test_a_jam_holds_the_warning_up_behind_its_platoon_only(platoon: int, jam_s: int) -> None:
    attacks = {ATTACK_S: JAM + platoon, ATTACK_S + 1: 4}
    free = warning_times(started(jam_budget_s=jam_s), {ATTACK_S + 1: 4}, 12)[0]
    jammed = warning_times(started(jam_budget_s=jam_s), attacks, 12)[0]
    behind = (PLATOONS - platoon + 1) * SIZE  # the first vehicle behind the blocked link
    over_s = ATTACK_S + jam_s
    assert np.array_equal(jammed[:behind], free[:behind])
    passed = max(free[behind], over_s + 0.1)
    np.testing.assert_allclose(jammed[behind:], passed + 0.1 * np.arange(40 - behind), atol=1e-9)


def test_the_jam_moves_and_ends_with_its_budget() -> None:
    game = started(jam_budget_s=3)
    go(game)
    assert game.action_mask("attacker")[0].tolist() == [True] * 8  # nobody drives behind platoon 1
    go(game, JAM + 4)
    assert not game.action_mask("attacker")[0, JAM + 4]
    seen = game.fields["attacker"].decode(game.observe("attacker"))
    assert seen["jammed"][0].tolist() == [0, 0, 1]  # ahead of platoons 1 to 3
    go(game, JAM + 2)
    seen = game.fields["attacker"].decode(game.observe("attacker"))
    assert seen["jammed"][0].tolist() == [1, 0, 0]
    go(game)
    seen = game.fields["attacker"].decode(game.observe("attacker"))
    assert seen["jammed"][0].tolist() == [0, 0, 0]
    assert seen["jam_left_s"][0] == pytest.approx(0, abs=1e-6)
    assert not game.action_mask("attacker")[0, JAM + 2 :].any()
    assert game.state.jam_place[0] == -1


def test_what_the_radio_is_like_shows_before_an_attack_in_the_silence_alone() -> None:
    games = [started(hop_delay_s=hop_s, hop_loss=loss) for hop_s, loss in ((0.05, 0.0), (0.2, 0.3))]
    for game in games:
        go(game, num_steps=40)
    assert np.array_equal(games[0].observe("attacker"), games[1].observe("attacker"))
    one, other = (game.fields["defender"].decode(game.observe("defender")) for game in games)
    assert [name for name in one if not np.array_equal(one[name], other[name])] == ["silence_s"]
    assert one["silence_s"].max() < 0.01
    assert 0.2 < other["silence_s"].max() < 3


def test_silence_tells_a_jam_from_peace_in_both_forms() -> None:
    game = started(hop_loss=0.3, jam_budget_s=6)
    go(game, 0)
    go(game, JAM + 3, num_steps=55)
    silence = game.fields["defender"].decode(game.observe("defender"))["silence_s"][0]
    assert silence[20 - SIZE] == pytest.approx(5.5, abs=0.5)  # the leader behind the jam, and nobody else
    assert np.delete(silence, 20 - SIZE).max() < 3
    rows = vehicle_fields(game.config).decode(game.team("defender").observe())
    np.testing.assert_allclose(rows["silence_s"][0, SIZE:], silence, atol=1e-4)
    go(game, num_steps=15)
    silence = game.fields["defender"].decode(game.observe("defender"))["silence_s"][0]
    assert silence.max() < 3


def test_two_disbanded_platoons_tell_of_the_nearer_one() -> None:
    game = started()
    for attack in (0, 4, 2):
        go(game, attack)
    go(game, num_steps=60)
    sources = game.state.record_position[0]
    assert sources[25] < game.state.position[0, 15]  # not the front platoon's last vehicle, by way of platoon 3
    assert np.all(sources[30:] < game.state.position[0, 20])  # platoon 2, not platoon 4
    assert np.all(sources[10:20] > game.state.position[0, 10])  # platoon 4


def test_the_truth_shows_the_episode_as_it_goes_on() -> None:
    game = started(hop_delay_s=2.0)
    truth = game.truth(0)
    go(game)
    go(game, 3, num_steps=5)
    assert truth["disbanding_s"].tolist() == [np.inf, 1.0, np.inf, np.inf]
    for name in ("position", "speed", "acceleration", "command"):
        assert np.array_equal(truth[name], getattr(game.state, name)[0])
