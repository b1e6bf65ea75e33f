"""Whatever happens the state stays physical, and no defence beats the bound."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.game.play import play_episodes
from cps_envs.disbanding.config import INTERPRETATIONS
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.disbanding.state import State
from tests.disbanding.table_2_1 import metrics, run, start, table_2_1
from tests.turns import in_turn
from tools.disbanding.bounds import TwoAttackSearch, least_error_of_two, least_errors

WIDTH, PLATOONS = 20, 4
GROWING = ("step", "speed_error", "intact_error", "rear_collided", "collided", "collided_intact", "stops")


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def rows(low: float, high: float) -> st.SearchStrategy[np.ndarray]:
    seeds = st.integers(0, 2**32 - 1)
    return seeds.map(lambda seed: np.random.default_rng(seed).uniform(low, high, (1, WIDTH)))


situations = st.fixed_dictionaries(
    {
        "interpretation": st.sampled_from(list(INTERPRETATIONS)),
        "num_vehicles": st.sampled_from([10, 15, 20]),
        "tau_s": numbers(0.05, 0.6),
        "desired_gap_m": numbers(1.5, 8.0),
        "attack": st.dictionaries(st.integers(1, PLATOONS), numbers(0.0, 8.0), max_size=3),
        "gap_factor": rows(0.5, 1.5),
        "speed_offset_mps": rows(-10.0, 5.0),
        "takeover_delay_s": rows(0.0, 2.0),
        "driver_headway_s": rows(0.5, 2.5),
    }
)


@settings(max_examples=60, deadline=None)
@given(situation=situations, corrections=st.lists(rows(-6.0, 6.0), min_size=4, max_size=4))
def test_whatever_happens_the_state_stays_physical(situation: dict[str, Any], corrections: list[np.ndarray]) -> None:
    names = ("interpretation", "num_vehicles", "tau_s", "desired_gap_m")
    parameters = table_2_1(1, vehicles_per_platoon=5, **{name: situation.pop(name) for name in names})
    attack = situation.pop("attack").items()
    state = start(parameters, attack, PLATOONS, **situation)
    present = int(parameters["num_vehicles"][0])
    for correction in corrections:
        before = State(*(array.copy() for array in state))
        run(state, parameters, 4.0, correction)
        for name in ("position", "speed", "acceleration", "command", "speed_error", "intact_error"):
            assert np.isfinite(getattr(state, name)).all(), name
        assert (state.speed >= 0.0).all()
        assert (state.speed <= 36.0).all()
        assert (np.abs(state.acceleration[0, :present] + 2.0) <= 3.0 + 1e-9).all()
        for name in GROWING:
            assert (getattr(state, name) >= getattr(before, name)).all(), name
        if not parameters["inelastic_contact"][0]:
            assert (state.position[0, :present] >= before.position[0, :present]).all()
        assert_consistent(state, before, metrics(state, parameters))


def assert_consistent(state: State, before: State, ours: dict[str, float]) -> None:
    """What the accumulators must say about one another."""
    involved = state.rear_collided.copy()
    involved[:, :-1] |= state.rear_collided[:, 1:]
    np.testing.assert_array_equal(state.collided, involved)
    assert (state.collided | ~state.collided_intact).all()
    assert (state.first_collision_s[0] >= 0.0) == state.collided.any()
    if before.first_collision_s[0] >= 0.0:
        assert state.first_collision_s[0] == before.first_collision_s[0]
    assert ours["collided"] == state.collided.sum()
    assert 0.0 <= ours["stopped_share"] <= 100.0
    assert 0.0 <= ours["velocity_error_intact"] <= 100.0


# Independent estimates of the specification's authors, at gaps of x_d and of 1 m.
@pytest.mark.parametrize(("tau_s", "wide", "narrow"), [(0.1, 15.19, 11.93), (0.3, 15.63, 12.37), (0.5, 16.42, 13.16)])
def test_the_bound_of_the_lead_attack(tau_s: float, wide: float, narrow: float) -> None:
    config = DISBANDING.config("paper", {"tau_s": tau_s})
    assert least_errors(config, 5.0)["velocity_error_intact"][0] == pytest.approx(wide, abs=0.02)
    assert least_errors(config, 1.0)["velocity_error_intact"][0] == pytest.approx(narrow, abs=0.02)


def test_a_smaller_gap_lowers_the_bound_evenly() -> None:
    config = DISBANDING.config("paper", {})
    found = [least_errors(config, gap_m)["velocity_error_intact"][0] for gap_m in (1.0, 2.0, 3.0, 4.0)]
    slope = np.diff(found)
    assert np.allclose(slope, slope[0], rtol=1e-6)
    # 45.5 gaps of a metre stand, on average over 90 vehicles, between a vehicle and the disbanded one.
    assert slope[0] == pytest.approx(100 * 45.5 / (180 * 31), rel=1e-6)


@pytest.mark.parametrize("defender", ["string", "informed"])  # who come nearest
def test_nobody_beats_the_bound_at_its_own_smallest_gap(defender: str) -> None:
    overrides = {"attack_budget": 1, "quiet_share": 0.2}
    config, seeds = DISBANDING.config("learning", overrides), range(600_000, 600_008)
    outcome = play_episodes(DISBANDING, config, {"attacker": "lead", "defender": defender}, seeds)
    bound = least_errors(config, outcome["smallest_gap_m"], seeds)
    for name, least in bound.items():
        assert np.all(outcome[name] >= least - 1e-6), name
    assert (bound["velocity_error_all"] == 0).any()
    assert (bound["velocity_error_all"] > 5).any()


# Independent estimates for platoons 10 and 9 at 2 s and 100 s, at gaps of x_d, on a coarse grid of states.
@pytest.mark.parametrize(("tau_s", "estimate"), in_turn([(0.1, 25.66), (0.5, 27.74)], 2))
def test_the_reference_of_two_attacks(tau_s: float, estimate: float) -> None:
    config = DISBANDING.config("paper", {"tau_s": tau_s})
    found = least_error_of_two(config, 5.0, search=TwoAttackSearch(generations=30))[0]
    assert estimate - 1.0 < found < estimate + 0.1  # a finer search finds lower sums, never higher ones
    alone = least_errors(config, 5.0, time_s=2.0)["velocity_error_all"][0]
    assert found > alone


@pytest.mark.slow
def test_a_longer_search_lowers_the_reference_and_smaller_gaps_do() -> None:
    config = DISBANDING.config("paper", {})
    short, long = (least_error_of_two(config, 3.0, search=TwoAttackSearch(generations=count))[0] for count in (5, 20))
    assert long <= short
    assert least_error_of_two(config, 1.0, search=TwoAttackSearch(generations=20))[0] < long


def test_episodes_without_these_two_attacks_have_no_reference() -> None:
    config = DISBANDING.config("paper", {"attack_budget": 2})
    apart = "plan?events=[[10,2],[8,60]]"
    assert np.isnan(least_error_of_two(config, 3.0, attacker=apart)[0])
    assert np.isnan(least_error_of_two(config, 3.0, attacker="lead")[0])


# `joint` is held against it in test_joint.py, where it plays anyway; the others are farther above it than these.
@pytest.mark.parametrize("defender", in_turn(["informed", "string", "copy"], 3))
def test_nobody_without_a_collision_beats_the_reference_of_two(defender: str) -> None:
    checked = 0
    for tau_s in (0.1, 0.5):
        config = DISBANDING.config("paper", {"tau_s": tau_s, "report": "safety"})
        outcome = play_episodes(DISBANDING, config, {"attacker": "table_2_3", "defender": defender}, (0,))
        if not outcome["collided"][0]:
            bound = least_error_of_two(config, outcome["smallest_gap_m"], search=TwoAttackSearch(generations=10))
            assert outcome["velocity_error_all"][0] >= bound[0]
            checked += 1
    assert checked
