"""A leader whose speed is a series, and a platoon that follows by its own law."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.cycles import shipped_cycle
from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.problem import ROGUE
from tests.rogue.games import go, seen, started

HUMAN = [CONTROLLERS.index("human"), 0]
CALM = {"preset": "city", "attack_share": 0.0}


def test_the_reference_drives_the_cycle() -> None:
    game = started((0, 1, 2), **CALM)
    begin_s = game.state.place * 0.1
    assert game.drawn["reference_speed_mps"] == pytest.approx(shipped_cycle("udds").at(begin_s, "linear")[:, 0])
    driven = np.zeros(3)
    for period in range(300):
        before = game.drawn["reference_speed_mps"].copy()
        go(game, 0.0)
        now = shipped_cycle("udds").at(begin_s + 0.1 * (period + 1), "linear")[:, 0]
        assert game.drawn["reference_speed_mps"] == pytest.approx(now, abs=1e-9)
        driven += 0.05 * (before + now)
    reference = game.drawn["reference_start_m"] + game.drawn["reference_speed_mps"] * 30.0
    leader = np.array([game.state.position[b, n - 1] for b, n in enumerate(game.drawn["num_vehicles"])])
    assert game.metrics()["reference_error_m"] == pytest.approx(reference - leader, abs=1e-9)
    start = np.array([episode.state.position[0, n - 1] for episode, n in calm_starts()])
    assert reference - start == pytest.approx(driven, abs=0.05)  # semi-implicit, as the vehicles move
    assert seen(game, "defender")["reference_speed"] == pytest.approx(game.drawn["reference_speed_mps"], abs=1e-4)


def calm_starts() -> list[Any]:
    games = [started((seed,), **CALM) for seed in range(3)]
    return [(game, game.drawn["num_vehicles"][0]) for game in games]


def test_the_platoon_follows_without_an_attack() -> None:
    game = started(range(8), **CALM)
    go(game, 0.0, num_steps=600)
    assert not game.metrics()["collisions"].any()
    assert np.abs(game.metrics()["reference_error_m"]).max() < 2.0


def test_a_long_step_is_many_short_ones() -> None:
    many, one = (started((4, 5), "city") for _ in range(2))
    for _ in range(50):
        go(many, 1.0)
    go(one, 1.0, num_steps=50)
    np.testing.assert_array_equal(many.state.position, one.state.position)
    np.testing.assert_array_equal(many.drawn["reference_start_m"], one.drawn["reference_start_m"])


def test_people_stand_still_where_the_cycle_does() -> None:
    still = Series(np.zeros(200), 1.0)
    game = started((0,), "city", leader_speed_mps=still, series_split="all", attack_share=0.0)
    go(game, 0.0, HUMAN * game.config.num_orders, num_steps=300)
    assert np.isfinite(game.state.position).all()
    assert game.state.speed.max() < 0.3


def test_training_and_judgements_share_no_second() -> None:
    config = ROGUE.config("city", {})
    game = ROGUE.game(config, 64)
    places = {}
    for name, first in (("judged", 0), ("learned", training_seed(3))):
        game.reset(np.ones(64, bool), seeded(range(first, first + 64)))
        places[name] = game.state.place * 0.1
    assert (places["judged"] // 120 % 2 == 1).all()
    assert (places["learned"] // 120 % 2 == 0).all()
    assert len(set(places["learned"].tolist())) > 40
    assert ((places["learned"] % 120) <= 60).all()


def test_a_constant_series_is_the_constant_reference() -> None:
    steady = Series(np.full(300, 25.0), 1.0)
    fixed = {"reference_speed_mps": 25.0, "num_vehicles": 5, "attacker_index": 2}
    one, other = started((3,), "learning", **fixed), started((3,), "learning", **fixed, leader_speed_mps=steady)
    for game in (one, other):
        go(game, 1.0, num_steps=100)
    assert other.state.position == pytest.approx(one.state.position, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"leader_speed_mps": 20.0}, "is one number: give it as reference_speed_mps"),
        ({"leader_speed_mps": Series(np.ones((99, 2)), 1.0)}, "several columns"),
        ({"leader_speed_mps": Series(np.ones(40), 1.0)}, "there are 39 s .* needs 60 s"),
        ({"leader_speed_mps": Series(np.full(400, 55.0), 1.0)}, "leader_speed_mps = Series.* is out of reach"),
        (
            {"leader_speed_mps": Series([10, 10, 30] * 200, 1.0)},
            "sample 2: it changes by 20 m/s2, where some vehicle is capable",
        ),
        ({"drive_mps2": 1.2, "drag_per_s": 0.02}, "so that nobody could keep the platoon together"),
        ({"leader_speed_mps": Series([70, 10] * 99, 1.0)}, r"sample 0: 70 is outside \[0, 60\] m/s"),
    ],
)
def test_cycles_that_nobody_can_follow_are_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        ROGUE.game(ROGUE.config("city", change), 1)
