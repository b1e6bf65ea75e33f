"""What preset `learning` pays for: impacts beyond what bumpers take, and places that can be reached."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.compute.kernels import records, unpack, view
from cps_envs.core.types import Array
from cps_envs.rogue.contact import touch
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.formation import place, reference_position
from cps_envs.rogue.payoff import Metrics
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import Drawn, Rules, allocate, rules_of
from tests import episodes
from tests.rogue.games import FIXED, started

SEEDS = range(95_000, 95_032)
play = partial(episodes.play, ROGUE, seeds=SEEDS, preset="learning", attack_share=1.0)


def paid(speed_mps: float, times: int, preset: str = "learning") -> float:
    """The damage of so many impacts of one speed, between which the pair parts."""
    r = unpack(Rules, rules_of(ROGUE.config(preset, {})), 0)
    pair, score = view(allocate(1, 2), 0), records(Metrics, 1).view(np.recarray)[0]
    pair.length_m[:] = 4.5
    for _ in range(times):
        pair.position[:], pair.speed[:], pair.armed[:] = (0.0, 4.49), (25 + speed_mps, 25), True
        touch(pair, 0, score, r)
    assert pair.collisions[0] == times
    return float(pair.damage[0])


def test_taps_pay_next_to_nothing() -> None:
    """A minute of taps at 1 Hz, by which a learner was paid more than by ramming when all impacts counted in full."""
    assert paid(0.7, 60) <= 0.1 * paid(8.0, 1)
    assert paid(0.7, 60, "easy") > 5 * paid(8.0, 1, "easy")


@given(st.floats(0.01, 40), st.floats(0.01, 40))
def test_one_impact_pays_more_than_two_with_the_same_sum_of_speeds(one_mps: float, other_mps: float) -> None:
    assert paid(one_mps + other_mps, 1) >= paid(one_mps, 1) + paid(other_mps, 1) - 1e-9


def test_an_impact_pays_its_speed_beyond_what_bumpers_take() -> None:
    assert paid(8.0, 1) == pytest.approx(6.0)
    assert paid(8.0, 1, "easy") == pytest.approx(8.0)


def places(seized_m: float, *, attacked: bool = True) -> Array:
    """Where four of five vehicles ought to be; all relative to the reference, as is the seized one in the middle."""
    game = started((0,), "learning", **FIXED, onset_s=1.0)
    vehicles, c, r = view(game.state, 0), unpack(Drawn, game.drawn, 0), unpack(Rules, game.rules, 0)
    reference = reference_position(vehicles, c, r)
    vehicles.position[2] = reference + seized_m
    return np.array([place(vehicles, i, reference, attacked, c, r) - reference for i in (0, 1, 3, 4)])


def test_nobody_has_a_place_beyond_a_seized_vehicle_that_is_in_the_way() -> None:
    assert places(-18.0) == pytest.approx([-36, -27, -9, 0])
    assert places(-100.0) == pytest.approx([-118, -109, -9, 0])
    assert places(50.0) == pytest.approx([-36, -27, 59, 68])
    assert places(50.0, attacked=False) == pytest.approx([-36, -27, -9, 0])


def test_a_seized_vehicle_that_stands_still_earns_little() -> None:
    """It cannot be passed. A defender who lets it stand is charged next to nothing, where `log_place` charges 17."""
    brake, front = "always?action=-1", "assigned?laws=f"
    assert play(brake, front)["return"].mean() < 3.0
    assert play(brake, front, formation_cost="log_place")["return"].mean() > 10.0
    ramming = play("contested?against=monitor", "monitor")["return"].mean()
    assert play(brake, "monitor")["return"].mean() < 0.5 * ramming


def test_only_the_preset_for_learning_has_this_pay() -> None:
    for name, config in ROGUE.presets.items():
        assert (config.bumper_mps > 0) == (name in ("learning", "city"))
        assert (config.formation_cost == "open_place") == (name in ("learning", "city"))


def test_the_neutral_action_of_learning_is_the_sliding_mode_for_all() -> None:
    for preset, controller in (("paper", "linear"), ("easy", "linear"), ("learning", "sliding")):
        action = episodes.spec_of(ROGUE, "defender", preset).neutral_action
        assert action[::2].tolist() == [CONTROLLERS.index(controller)] * (len(action) // 2)
        assert not action[1::2].any()
    none, sliding = (play("random", name, seeds=SEEDS[:4], duration_s=10.0)["return"] for name in ("none", "sliding"))
    assert np.array_equal(none, sliding)
