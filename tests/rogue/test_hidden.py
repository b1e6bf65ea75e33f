"""The hidden seat: orders for all, drawn sizes, episodes without an attack, and the price of leaving one's place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import NEVER
from tests.rogue.games import FIXED, go, seen, started

QUIET = dict.fromkeys(("range_noise_m", "range_rate_noise_mps", "speed_noise_mps", "acceleration_noise_mps2"), 0.0)
SLIDING, HUMAN = CONTROLLERS.index("sliding"), CONTROLLERS.index("human")


def test_episodes_draw_sizes_seats_and_whether_there_is_an_attack() -> None:
    game = started(range(400), "learning")
    sizes, seats = game.drawn["num_vehicles"], game.drawn["attacker"]
    assert sorted(set(sizes.tolist())) == [4, 5, 6, 7, 8]
    for size in range(4, 9):
        assert sorted(set(seats[sizes == size].tolist())) == list(range(size - 1))  # never the leader
    quiet = game.drawn["onset_step"] == NEVER
    assert np.mean(quiet) == pytest.approx(0.25, abs=0.07)  # three standard deviations
    assert (game.drawn["onset_step"][~quiet] * game.config.dt_s).max() <= game.config.duration_s / 2


def test_a_seat_out_of_reach_of_the_smallest_platoon_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="begin below 4"):
        ROGUE.config("learning", {"attacker_index": (4, 7)})
    with pytest.raises(ConfigurationError, match=r"\(1, 7\) for any vehicle but the leader"):
        ROGUE.config("learning", {"attacker_index": (1, 9)})


def test_nothing_that_the_defender_sees_marks_the_seized_vehicle_before_the_onset() -> None:
    """The same episode with another vehicle seized looks the same until the attack begins."""
    shown = []
    for seat in (1, 3):
        game = started((4,), "learning", **(FIXED | {"attacker_index": seat, "onset_s": 20.0}))
        go(game, 1.0, [5, 1] * 5, 150)
        shown.append((game.observe("defender"), game.team("defender").observe()))
    assert all(np.array_equal(one, other) for one, other in zip(*shown, strict=True))
    assert "attacker_index" not in seen(game, "defender") or seen(game, "defender")["attacker_index"].size == 0


def test_the_seized_vehicle_obeys_until_the_onset_and_ignores_its_orders_after_it() -> None:
    runs = []
    for law in (SLIDING, HUMAN):
        game = started((1,), "learning", **(FIXED | {"onset_s": 10.0}))
        orders = np.tile([SLIDING, 0], 5)
        orders[4] = law
        go(game, 0.0, orders, 100)
        before = game.state.speed[0, 2]
        go(game, 1.0, orders, 1)
        runs.append((before, game.state.effort[0, 2], game.state.controller[0, 2]))
    assert runs[0][0] != runs[1][0]
    assert [run[1] for run in runs] == [1.0, 1.0]
    assert [run[2] for run in runs] == [SLIDING, HUMAN]  # what it reports is what it was told


def test_without_an_attack_the_attackers_actions_change_nothing() -> None:
    finals = []
    for attack in (-1.0, 1.0):
        game = started((2,), "learning", attack_share=0.0)
        go(game, attack, [1, 0] * 8, 600)
        finals.append(game.state.position.copy())
        assert game.metrics()["attacked"] == 0
    assert np.array_equal(*finals)


@settings(max_examples=8, deadline=None)
@given(size=st.integers(4, 8), seed=st.integers(0, 1000))
def test_an_episode_of_a_drawn_size_is_the_platoon_of_that_size(size: int, seed: int) -> None:
    """Vehicles that an episode does not have change nothing: padding is not physics."""
    exact = dict(QUIET, attack_share=1.0, spacing_spread_m=0.0, speed_spread_mps=0.0, onset_s=1.0, power_ratio=1.2)
    exact |= {"drive_mps2": 5.0, "drag_per_s": 0.1, "reference_speed_mps": 25.0, "attacker_index": 2}
    drawn = RogueGame(ROGUE.config("learning", exact), 1)
    while True:
        drawn.reset(np.ones(1, bool), [np.random.default_rng(seed)])
        if drawn.drawn["num_vehicles"][0] == size:
            break
        seed += 1
    alone = started((seed,), "learning", **exact, num_vehicles=size)
    orders = np.random.default_rng(seed).integers(0, [len(CONTROLLERS), 2] * 8)
    paid = go(drawn, 1.0, orders, 100), go(alone, 1.0, orders[: 2 * size], 100)
    assert paid[0] == paid[1]
    assert drawn.state.position[0, :size] == pytest.approx(
        alone.state.position[0] + drawn.state.position[0, 0] - alone.state.position[0, 0]
    )
    assert not drawn.state.position[0, size:].any()
    values = seen(drawn, "defender")
    assert values["present"][0].tolist() == [float(i < size) for i in range(4, 8)]
    assert not values["speed"][0, size:].any()


@pytest.mark.parametrize("cost", ["log_place", "open_place"])
def test_the_price_is_the_logarithm_of_the_mean_distance_from_the_places(cost: str) -> None:
    """Against positions that are taken down here, in an episode whose seized vehicle leaves and pushes others on."""
    game = started((3,), "learning", **FIXED, onset_s=3.0, formation_cost=cost)
    config, c = game.config, game.drawn[0]
    expected = 0.0
    for _ in range(300):
        go(game, 1.0, [1, 0] * 5)
        now_s = game.state.step[0] * config.dt_s
        places = c["reference_start_m"] + c["reference_speed_mps"] * now_s - 9.0 * np.arange(4, -1, -1)
        if cost == "open_place" and now_s >= 3.0:
            beside = game.state.position[0, 2] + 9.0 * np.arange(-2, 3)
            places = np.append(np.minimum(places, beside)[:2], np.maximum(places, beside)[2:])
        distance = np.abs(places - game.state.position[0])
        counted = np.arange(5) != 2 if now_s >= 3.0 else np.ones(5, bool)
        expected += 0.1 * np.log(1 + distance[counted].mean() / 9.0)
    metrics = game.metrics()
    assert metrics["formation_cost_s"][0] == pytest.approx(expected, rel=1e-9)
    assert metrics["formation_charge"][0] == pytest.approx(0.2 * expected, rel=1e-9)


def test_leaving_costs_more_the_farther_one_goes() -> None:
    """All brake and stay: the cost of a second grows to the end, where that of preset `easy` is flat."""
    rates = {}
    for preset, ordered in (("learning", 5), ("easy", 4)):
        game = started((0,), preset, num_vehicles=5, attacker_index=3, onset_s=30.0, defense_action="command")
        costs = [0.0]
        for _ in range(3):
            go(game, 0.0, [-1.0] * ordered, 200)
            costs.append(game.metrics()["formation_cost_s"][0])
        rates[preset] = np.diff(costs) / 20.0
    assert np.all(np.diff(rates["learning"]) > 0.3)
    assert rates["easy"][2] == pytest.approx(rates["easy"][1], rel=0.02)


def test_alarms_are_false_before_the_onset_and_where_they_blame_an_intact_vehicle() -> None:
    played = play_episodes(
        ROGUE,
        ROGUE.config("learning", {"attack_share": 0.0}),
        {"attacker": "none", "defender": "sliding_detection"},
        range(6000, 6040),
    )
    assert np.array_equal(played["false_alarms"], played["alarms"])  # nobody attacks
    game = started(range(30), "learning", attack_share=1.0, onset_s=0.0)
    go(game, 1.0, [5, 0] * 8, 300)
    for b in range(30):
        alarm, seat = game.state.alarm[b], game.drawn["attacker"][b]
        raised = np.flatnonzero(alarm)
        assert game.metrics()["false_alarms"][b] == np.count_nonzero(raised + alarm[raised] != seat)
    assert game.metrics()["alarms"].sum() > 0


def test_the_truth_is_what_was_drawn() -> None:
    game = started(range(20), "learning")
    for b in range(20):
        truth = game.truth(b)
        assert truth["seat"] == game.drawn["attacker"][b]
        onset_step = game.drawn["onset_step"][b]
        assert truth["onset_s"] == (onset_step * game.config.dt_s if onset_step < NEVER else np.inf)


def test_the_swarm_has_an_agent_for_every_vehicle() -> None:
    team = started((0,), "learning").team("defender")
    assert team.agents == tuple(f"vehicle_{k + 1}" for k in range(8))
    assert team.observe().shape[:2] == (1, 8)


@pytest.mark.parametrize("defense", [5, 1])
def test_steps_of_2_ms_are_short_enough_for_the_wider_boundary_layer(defense: int) -> None:
    """The mean return over 48 episodes moves by less than 3 % at half the step; single episodes move more."""
    means = []
    for dt_s in (0.002, 0.001):
        players = {"attacker": "duty_square", "defender": f"always?action={[defense, 0] * 8}".replace(" ", "")}
        config = ROGUE.config("learning", {"dt_s": dt_s})
        means.append(play_episodes(ROGUE, config, players, range(7000, 7048))["return"].mean())
    assert means[0] == pytest.approx(means[1], rel=0.03)


def test_the_viewer_shows_whom_the_alarms_blame_beside_who_attacks() -> None:
    pytest.importorskip("pygame")
    from cps_envs.rogue.picture.viewer import RogueViewer, belief

    game = started((0,), "learning", **FIXED, onset_s=2.0, alarm_threshold=20.0)
    go(game, 1.0, [5, 0] * 5, 10)
    early = game.scene(0)
    go(game, 1.0, [5, 0] * 5, 90)
    late = game.scene(0)
    assert belief(early) == "Alarms blame nobody; 3 attacks from 2.0 s on"
    raised = np.flatnonzero(game.state.alarm[0])
    assert late.blamed == sorted(set((raised + game.state.alarm[0, raised]).tolist()))
    assert len(late.blamed) > 0
    assert early.law[2] != "attacker"
    assert late.law[2] == "attacker"
    pictures = [RogueViewer(game.config).frame(scene) for scene in (early, late)]
    assert not np.array_equal(*pictures)
    quiet = started((0,), "learning", attack_share=0.0).scene(0)
    assert belief(quiet) == "Alarms blame nobody; nobody attacks"


@pytest.mark.slow
def test_no_constant_acceleration_beats_the_monitor() -> None:
    """A grid of constant commands by classes of places, against attackers of every kind, on seeds of this test."""
    attackers = ("none", "square?frequency_hz=0.05", "duty_square", "contested?against=pd", "contested?against=monitor")
    seeds = range(95_000, 95_024)
    paid = []
    for rear in (-1.0, -0.3, 0.0, 0.3, 1.0):
        for front in (-1.0, -0.3, 0.0, 0.3, 1.0):
            action = f"always?action={[rear] * 3 + [front] * 5}".replace(" ", "")
            paid.append(mean_return(attackers, action, seeds, defense_action="command"))
    assert min(paid) > mean_return(attackers, "monitor", seeds) + 1.0


def mean_return(attackers: Any, defender: str, seeds: Sequence[int], **overrides: Any) -> Any:
    config = ROGUE.config("learning", overrides)
    returns = [
        play_episodes(ROGUE, config, {"attacker": attacker, "defender": defender}, seeds)["return"].mean()
        for attacker in attackers
    ]
    return np.mean(returns)
