"""Several vehicles that attack together, and a seized leader."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.interfaces.swarm_env import SwarmVectorEnv
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.rogue.state import NEVER
from cps_envs.rogue_v0 import swarm_env
from tests.rogue.games import go, play, seen, spec_of, started

TWO: dict[str, Any] = {"attacker_indices": (2, 4), "num_vehicles": 5, "duration_s": 20.0}
HIDDEN = {**TWO, "attack_share": 1.0, "onset_s": 5.0}
APART = np.array([1.0, -1.0])  # the rear one drives, the other brakes
LEADER: dict[str, Any] = {"attacker_index": 5, "dt_s": 0.0005, "contact": "solid"}


def test_each_seized_vehicle_drives_by_its_own_effort() -> None:
    game = started((0,), "paper", **TWO)
    go(game, APART)
    assert game.state.effort[0, [1, 3]].tolist() == [1.0, -1.0]
    assert game.state.rogue[0].tolist() == [False, True, False, True, False]
    own = seen(game, "attacker")
    assert own["attacker_index"][0] == pytest.approx([2, 4])
    assert own["speed"][0] == pytest.approx(game.state.speed[0, [1, 3]], abs=1e-4)
    assert own["front_gap_error"][0] == pytest.approx(np.diff(game.state.position[0])[[1, 3]] - 9.0, abs=1e-4)
    told = seen(game, "defender")
    assert told["attacker_index"][0] == pytest.approx([2, 4])
    assert told["alarm"].shape == (1, 3)
    assert told["front_detector"][0] == pytest.approx(game.state.front_detector[0, [0, 2]], abs=0.1)


def test_all_of_them_obey_until_the_onset_and_nothing_marks_them() -> None:
    games = [started((3,), "learning", **{**HIDDEN, "attacker_indices": seats}) for seats in ((2, 4), (1, 3))]
    for game in games:
        go(game, APART, num_steps=50)
    first, second = (game.observe("defender") for game in games)
    assert np.array_equal(first, second)
    for game in games:
        go(game, APART, num_steps=5)
    assert not np.array_equal(games[0].observe("defender"), games[1].observe("defender"))


def test_an_alarm_that_blames_any_of_them_is_no_false_one() -> None:
    game = started((0,), "paper", **TWO)
    go(game, APART, defense=np.tile([5, 0], 3), num_steps=100)
    alarm, rogue = game.state.alarm[0], game.state.rogue[0]
    raised = np.flatnonzero(alarm)
    assert len(raised) > 0
    false = sum(not rogue[i + alarm[i]] for i in raised)
    assert game._scores["false_alarms"][0] == false


def test_places_lie_between_the_seized_vehicles() -> None:
    """Vehicle 3 between two that stand still has its place there, however far the reference is."""
    game = started((1,), "learning", **{**HIDDEN, "onset_s": 0.0})
    go(game, -1.0, num_steps=150)
    x, errors = game.state.position[0], game.team("defender").privileged()[0, :, -5]
    behind = np.sinh(4 * errors) * 0.2  # compressed errors are arsinh(e / 0.2) / 4
    assert x[1] + 9.0 == pytest.approx(x[2] + behind[2], abs=1e-2) or x[3] - 9.0 == pytest.approx(
        x[2] + behind[2], abs=1e-2
    )


def test_a_shifted_square_wave_runs_later_at_each_further_seat() -> None:
    attacker = resolve_policy("square?frequency_hz=0.1&shift=0.5", spec_of("attacker", "paper", **TWO))
    game = started((0,), "paper", **TWO)
    efforts = []
    state: Any = None
    for step in range(120):
        action, state = attacker.predict(game.observe("attacker"), state, np.array([step == 0]))
        game.advance({"attacker": action}, np.ones(1, bool), 1)
        efforts.append(game.state.held_effort[0, [1, 3]].copy())
    rear, front = np.transpose(efforts)
    assert rear[:50] == pytest.approx(1.0, abs=1e-5)
    assert front[:50] == pytest.approx(-1.0, abs=1e-5)
    assert (rear[50:100], front[50:100]) == (pytest.approx(-1.0, abs=1e-5), pytest.approx(1.0, abs=1e-5))


def test_alike_orders_of_all_seats_are_what_each_rule_gives_alone() -> None:
    """The switching attacker decides for each seat as it would for a vehicle with these sensors alone."""
    both, alone = (
        resolve_policy("tuned?front_gap=1&rear_gap=-2&bias=0.1", spec_of("attacker", "paper", **setting))
        for setting in (TWO, {**TWO, "attacker_indices": (), "attacker_index": 4})
    )
    game = started((0,), "paper", **TWO)
    go(game, APART, num_steps=17)
    shown = game.observe("attacker")
    lone = started((0,), "paper", **{**TWO, "attacker_indices": (), "attacker_index": 4})
    for mine, theirs in zip(lone.state, game.state, strict=True):
        mine[...] = theirs
    lone.state.rogue[0] = [False, False, False, True, False]
    start = np.ones(1, bool)
    action = both.predict(shown, None, start)[0]
    assert action.shape == (1, 2)
    assert action[0, 1] == alone.predict(lone.observe("attacker"), None, start)[0][0, 0]


@pytest.mark.parametrize("name", ["square", "duty_square", "random", "switching", "contested", "strike", "gains"])
def test_every_attacker_that_treats_seats_alike_plays_all_of_them(name: str) -> None:
    metrics = play(name, "sliding_detection", [0], "learning", **{**HIDDEN, "onset_s": 0.0, "duration_s": 5.0})
    assert metrics["attacked"].tolist() == [1.0]


@pytest.mark.parametrize("reference", ["identify", "escort", "informed"])
def test_policies_that_know_one_attacker_refuse_several(reference: str) -> None:
    role = "attacker" if reference == "identify" else "defender"
    with pytest.raises(ConfigurationError, match=r"attacker_indices = \(2, 4\): give"):
        resolve_policy(reference, spec_of(role, "learning", **HIDDEN))


def test_one_network_drives_both_alone_and_as_a_team() -> None:
    """The joint row of the single form and the rows of the team form are the same episode; a team shares its pay."""
    single: Any = gymnasium.make("cps_envs:cps_envs/RogueAttack-v0", **HIDDEN)
    assert single.action_space.nvec.tolist() == [3, 3]
    team = swarm_env(role="attacker", adapter="effort", **HIDDEN)
    row, _ = single.reset(seed=5)
    rows, _ = team.reset(seed=5)
    assert team.agents == ["seized_2", "seized_4"]
    for choice in ([2, 0], [0, 2], [2, 2], [1, 0]):
        assert np.array_equal(row, np.concatenate([rows[agent] for agent in team.agents]))
        row, reward, *_ = single.step(choice)
        rows, rewards, *_ = team.step(dict(zip(team.agents, choice, strict=True)))
        assert sum(rewards.values()) == pytest.approx(reward)
        assert rewards["seized_2"] == rewards["seized_4"]
    batch = swarm_env(role="attacker", adapter="effort", num_envs=3, **HIDDEN)
    assert isinstance(batch, SwarmVectorEnv)


def test_one_attacker_is_no_team() -> None:
    with pytest.raises(TypeError, match="no decentralised form"):
        swarm_env(role="attacker", preset="paper")


def test_a_seized_leader_has_nobody_ahead_and_all_others_have() -> None:
    game = started((0,), "paper", **LEADER)
    go(game, -1.0, num_steps=20)
    own = seen(game, "attacker")
    assert own["front_gap_error"][0] == own["front_gap_rate"][0] == 0.0
    assert own["rear_gap_error"][0] == pytest.approx(np.diff(game.state.position[0])[-1] - 9.0, abs=1e-4)
    assert seen(game, "defender")["front_detector"].shape == (1, 4)  # with an intact leader there are three
    assert game.state.front_detector[0, 3] > 0.0  # the vehicle behind watches it
    privileged = game.privileged("attacker")
    assert privileged.shape == (1, 16)
    assert privileged[0, :2].tolist() == [0.0, 0.0]


def test_a_seized_leader_leads_those_behind_away_from_the_reference() -> None:
    """It brakes, they brake behind it without a contact; nobody has a place beyond it."""
    world = {**LEADER, "duration_s": 30.0, "formation_cost": "open_place"}
    metrics = play("always?action=-1", "sliding", **world)
    assert metrics["damage"][0] == 0.0
    assert metrics["reference_error_m"][0] > 100.0
    assert metrics["formation_cost_s"][0] < 1.0


def test_drawn_seats_reach_the_leader_only_where_they_may() -> None:
    game = started(range(200), "learning", attacker_index=(1, 8), attack_share=1.0)
    sizes, seats = game.drawn["num_vehicles"], game.drawn["attacker"]
    for size in range(4, 9):
        assert sorted(set(seats[sizes == size].tolist())) == list(range(size))
    assert (game.drawn["onset_step"] < NEVER).all()
    assert game.privileged("attacker").shape == (200, 16)
    assert np.isfinite(game.team("defender").privileged()).all()
