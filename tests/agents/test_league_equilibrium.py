"""Zero-sum matrix games: known ones, and what holds for all."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

pytest.importorskip("scipy")

from cps_agents.league import equilibrium
from cps_agents.league.equilibrium import TOLERANCE, dominating, solve

PENNIES = np.array([[1.0, -1.0], [-1.0, 1.0]])
ROCK_PAPER_SCISSORS = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])
matrices = arrays(
    np.float64,
    array_shapes(min_dims=2, max_dims=2, max_side=6),
    elements=st.floats(-1e3, 1e3).map(lambda value: round(value, 3)),
)


def close(payoff: np.ndarray[Any, Any]) -> float:
    return 10 * TOLERANCE * (float(np.ptp(payoff)) or 1.0)


@pytest.mark.parametrize("game", [PENNIES, ROCK_PAPER_SCISSORS], ids=["pennies", "rock, paper, scissors"])
def test_a_fair_game_is_played_evenly(game: np.ndarray[Any, Any]) -> None:
    found = solve(game)
    np.testing.assert_allclose(found.attacker, np.full(len(game), 1 / len(game)), atol=1e-9)
    np.testing.assert_allclose(found.defender, np.full(len(game), 1 / len(game)), atol=1e-9)
    assert found.value == pytest.approx(0.0, abs=1e-9)


def test_a_game_whose_sides_mix_differently() -> None:
    """Of 2x2 games without saddle point the textbook gives value (ad - bc) / (a + d - b - c)."""
    found = solve(np.array([[3.0, 1.0], [0.0, 2.0]]))
    assert found.value == pytest.approx(6 / 4)
    np.testing.assert_allclose(found.attacker, [0.5, 0.5], atol=1e-9)
    np.testing.assert_allclose(found.defender, [0.25, 0.75], atol=1e-9)


def test_a_large_offset_costs_no_accuracy() -> None:
    found = solve(np.array([[3.0, 1.0], [0.0, 2.0]]) + 1e12)
    assert found.value - 1e12 == pytest.approx(6 / 4, abs=1e-3)
    np.testing.assert_allclose(found.attacker, [0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(found.defender, [0.25, 0.75], atol=1e-6)


def test_a_saddle_point_is_pure() -> None:
    found = solve(np.array([[4.0, 2.0, 3.0], [1.0, 0.0, 5.0]]))
    np.testing.assert_array_equal(found.attacker, [1.0, 0.0])
    np.testing.assert_array_equal(found.defender, [0.0, 1.0, 0.0])
    assert found.value == pytest.approx(2.0)


@settings(deadline=None)
@given(matrices)
def test_best_replies_to_the_equilibrium_gain_nothing(payoff: np.ndarray[Any, Any]) -> None:
    found = solve(payoff)
    for shares in (found.attacker, found.defender):
        assert shares.sum() == pytest.approx(1.0)
        assert (shares >= 0).all()
    assert (payoff @ found.defender).max() == pytest.approx(found.value, abs=close(payoff))
    assert (found.attacker @ payoff).min() == pytest.approx(found.value, abs=close(payoff))
    assert -close(payoff) <= found.gap <= close(payoff)


@settings(deadline=None)
@given(matrices)
def test_the_value_lies_between_the_pure_guarantees(payoff: np.ndarray[Any, Any]) -> None:
    value, slack = solve(payoff).value, close(payoff)
    assert payoff.min(axis=1).max() - slack <= value <= payoff.max(axis=0).min() + slack


@settings(deadline=None)
@given(matrices, st.floats(0.1, 10), st.floats(-100, 100), st.randoms(use_true_random=False))
def test_the_value_moves_with_scale_and_offset_and_not_with_order(
    payoff: np.ndarray[Any, Any], factor: float, offset: float, order: Any
) -> None:
    value = solve(payoff).value
    slack = 2 * factor * close(payoff) + 1e-9
    assert solve(factor * payoff + offset).value == pytest.approx(factor * value + offset, abs=slack, rel=1e-9)
    rows, columns = list(range(len(payoff))), list(range(payoff.shape[1]))
    order.shuffle(rows)
    order.shuffle(columns)
    assert solve(payoff[np.ix_(rows, columns)]).value == pytest.approx(value, abs=slack, rel=1e-9)
    assert solve(-payoff.T).value == pytest.approx(-value, abs=slack, rel=1e-9)


@settings(deadline=None)
@given(matrices)
def test_dominated_rows_are_never_played(payoff: np.ndarray[Any, Any]) -> None:
    found, dominators = solve(payoff), dominating(payoff)
    for row, dominator in enumerate(dominators):
        if dominator is not None:
            assert ((dominator @ payoff) > payoff[row]).all()
            assert dominator[row] == 0
            assert found.attacker[row] == pytest.approx(0.0, abs=1e-3)


def test_domination_by_one_and_by_a_mixture() -> None:
    payoff = np.array([[4.0, 0.0], [0.0, 4.0], [1.0, 1.0], [-1.0, 3.0]])
    first, second, mixed, pure = dominating(payoff)
    assert first is None
    assert second is None
    assert mixed is not None
    np.testing.assert_allclose((mixed @ payoff).min(), 2.0)
    assert pure is not None
    np.testing.assert_array_equal(pure, [0.0, 1.0, 0.0, 0.0])
    assert dominating(np.array([[1.0, 2.0], [1.0, 2.0]])) == [None, None]
    assert dominating(np.array([[1.0]])) == [None]


@pytest.mark.parametrize("wrong", [np.zeros((0, 2)), np.zeros(3), np.array([[np.nan]])])
def test_what_is_no_game(wrong: np.ndarray[Any, Any]) -> None:
    with pytest.raises(ValueError, match="matrix game"):
        solve(wrong)


def test_domination_does_not_depend_on_the_scale() -> None:
    for scale in (1e-7, 1.0, 1e7):
        found = dominating(scale * np.array([[1.0, 2.0], [2.0, 3.0]]))
        assert found[0] is not None
        assert found[0].tolist() == [0.0, 1.0]
        assert found[1] is None


def test_a_program_that_is_not_solved_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = SimpleNamespace(success=False, message="time is over", x=np.full(3, 1 / 3))
    monkeypatch.setattr("scipy.optimize.linprog", lambda *_, **__: failed)
    with pytest.raises(ArithmeticError, match="time is over"):
        solve(np.array([[1.0, -1.0], [-1.0, 1.0]]))


def test_mixtures_that_leave_a_gap_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(equilibrium, "maximin", lambda payoff: np.eye(len(payoff))[0])
    with pytest.raises(ArithmeticError):
        solve(np.array([[1.0, -1.0], [-1.0, 1.0]]))
