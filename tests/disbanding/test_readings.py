"""What chapter 2 only mentions, as options: another integration step, the standstill rule, transitional controllers."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.conformance import check_refinement, refine
from cps_envs.disbanding.config import EASY, INTERPRETATIONS, PAPER
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.disbanding.state import State
from tests.disbanding.table_2_1 import LEAD, metrics, run, start, table_2_1

LEAD_ONLY = {"attacker": "lead"}


def played(seconds: int, correction: Any = 0.0, seed: int = 0, **overrides: Any) -> Any:
    """A game in which the lead platoon is disbanded at 1 s, after some seconds under a constant correction."""
    game = DISBANDING.game(DISBANDING.config("paper", overrides), 1)
    every = np.ones(1, np.bool_)
    game.reset(every, [np.random.default_rng(seed)])
    defence = np.broadcast_to(np.asarray(correction, np.float64), (1, game.config.max_vehicles))
    for second in range(seconds):
        attack = np.array([game.config.max_platoons if second == 1 else 0])
        game.advance({"attacker": attack, "defender": defence}, every, game.config.periods_per_second)
    return game


def assert_same(ours: State, theirs: State, but: tuple[str, ...] = ()) -> None:
    for name in State._fields:
        if name not in but:
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)


@pytest.mark.parametrize("interpretation", INTERPRETATIONS)
def test_the_interpretation_s_own_step_changes_nothing(interpretation: str) -> None:
    usual = played(12, interpretation=interpretation)
    named = played(12, interpretation=interpretation, dt_s=INTERPRETATIONS[interpretation].dt_s)
    assert_same(usual.state, named.state)


def test_the_step_is_the_one_that_is_asked_for() -> None:
    fine = DISBANDING.config("paper", {"dt_s": 0.005})
    assert (fine.steps_per_period, fine.horizon_steps) == (20, 36_000)
    game = played(3, dt_s=0.005)
    assert game.state.step[0] == 600
    assert game.state.disbanding_s[0, 0] == 1.0
    assert game.scene(0).time_s == pytest.approx(3.0)


def test_the_error_of_the_integration_is_of_first_order() -> None:
    """Explicit Euler: each halving of the step about halves what the next one changes, in the disbanded platoon.

    Farther back the waves switch collision avoidance on and off, at other times with another step.
    """
    places = [played(6, dt_s=dt_s).state.position[0] for dt_s in (0.02, 0.01, 0.005, 0.0025)]
    changes = [np.abs(coarse - fine)[:12].max() for coarse, fine in pairwise(places)]
    assert changes[0] < 0.5
    assert all(1.6 < larger / smaller < 3.0 for larger, smaller in pairwise(changes))


@pytest.mark.parametrize("defender", ["copy", "feedback"])
def test_a_smooth_defence_does_not_depend_on_the_step(defender: str) -> None:
    players = {**LEAD_ONLY, "defender": defender}
    found = check_refinement(
        DISBANDING, players, {"dt_s": 0.005}, metric="velocity_error_intact", tolerance=0.005, tau_s=0.3
    )
    assert found.fine > 17.0


def test_collisions_depend_on_the_step() -> None:
    """What the documentation warns of: after collisions a single episode moves by more than its third digit."""
    arguments: Any = {"metric": "velocity_error_intact", "tau_s": 0.5}
    found = refine(DISBANDING, {**LEAD_ONLY, "defender": "none"}, {"dt_s": 0.005}, **arguments)
    assert 0.002 < found.change < 0.05
    with pytest.raises(AssertionError, match="dt_s"):
        check_refinement(DISBANDING, {**LEAD_ONLY, "defender": "none"}, {"dt_s": 0.005}, tolerance=0.002, **arguments)


def test_s1_is_the_transitional_controller_and_its_step() -> None:
    usual = played(30, interpretation="S1", tau_s=0.3)
    composed = played(30, transitional_controller=True, dt_s=0.02, tau_s=0.3)
    assert_same(usual.state, composed.state)
    without = played(30, dt_s=0.02, tau_s=0.3)
    assert (without.state.position != composed.state.position).any()


@pytest.mark.parametrize(("tau_s", "expected"), [(0.1, 29.6), (0.3, 29.8), (0.5, 30.1)])
def test_nobody_collides_under_the_standstill_rule(tau_s: float, expected: float) -> None:
    """Section 8.2 of the specification: without any defence, and by less than half of the errors at 0.5 s."""
    parameters = table_2_1(tau_s=tau_s, standstill_rule=True)
    state = start(parameters, LEAD)
    run(state, parameters, 180.0)
    found = metrics(state, parameters)
    assert found["collided"] == 0
    assert found["velocity_error_intact"] == pytest.approx(expected, abs=0.06)


@settings(max_examples=25, deadline=None)
@given(
    tau_s=st.floats(0.1, 0.6),
    desired_gap_m=st.floats(2.0, 8.0),
    standstill_gap_m=st.floats(0.5, 1.5),
    push=st.floats(-1.0, 1.0),
    member_delay_s=st.floats(0.0, 1.0),
    seed=st.integers(0, 99),
)
def test_who_is_too_near_stands(
    tau_s: float, desired_gap_m: float, standstill_gap_m: float, push: float, member_delay_s: float, seed: int
) -> None:
    """Whatever the defender does: a step can take at most v_max dt = 0.36 m of r_0, and the next one nothing."""
    game = played(
        0,
        tau_s=tau_s,
        desired_gap_m=desired_gap_m,
        standstill_gap_m=standstill_gap_m,
        member_delay_s=member_delay_s,
        attacked_member=(1, 4),
        num_platoons=3,
        vehicles_per_platoon=4,
        standstill_rule=True,
        gap_spread=0.05,
        control_period_s=0.01,
        seed=seed,
    )
    every, correction = np.ones(1, np.bool_), np.random.default_rng(seed).uniform(-1, 1, (1, 12)) + push
    stood = 0
    for period in range(1200):
        attack = np.array([3 if period == 100 else 0])
        before = game.state.position[0].copy()
        near = np.r_[False, -np.diff(before) < standstill_gap_m]
        game.advance({"attacker": attack, "defender": np.clip(correction, -1, 1)}, every, 1)
        moved = game.state.position[0] - before
        assert np.all(moved[near] == 0.0)
        assert np.all(-np.diff(game.state.position[0]) > standstill_gap_m - 36.0 * 0.01 - 1e-9)
        stood += int(near.sum())
    assert not game.state.collided.any()


def test_the_rules_are_off_unless_asked_for() -> None:
    for config in (PAPER, EASY):
        assert (config.dt_s, config.standstill_rule, config.transitional_controller) == (0.0, False, False)
        assert config.dynamics == INTERPRETATIONS["S0"]
    assert played(20, tau_s=0.5).state.collided.any()
    assert not played(20, tau_s=0.5, standstill_rule=True).state.collided.any()
