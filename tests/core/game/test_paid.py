"""Another payoff than the game's own, by value, on the tank: episodes apart, steps at once, what cannot be paid."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.declare.config import configure
from cps_envs.core.declare.objective import foreign_pay, is_own, weights_of
from cps_envs.core.errors import ConfigurationError, UnknownNameError, UntrustedCodeError
from cps_envs.core.game.objective import Objective
from cps_envs.core.types import FloatArray
from tests.core.tank import TankConfig, TankGame
from tests.core.toy import ToyConfig

EVERYONE = np.ones(3, np.bool_)
OPEN = {"attacker": np.array([1, 1, 2]), "defender": np.array([[2, 1, 1, 0]] * 3)}
CALLS: list[Any] = []


def excess(increments: Any) -> FloatArray:
    """Not to be had by weights, and kept to be looked at."""
    CALLS.append({name: values.copy() for name, values in increments.items()})
    return np.maximum(increments["rise"] - 0.3, 0.0) - increments["energy"]


def started(payoff: Any) -> TankGame:
    game = TankGame(TankConfig(steps=60, inflow=(0.1, 0.6), payoff=configured(payoff).payoff), 3)
    game.reset(EVERYONE, [np.random.default_rng(b) for b in range(3)])
    return game


def configured(payoff: Any) -> TankConfig:
    found: TankConfig = configure(TankConfig(), {"payoff": payoff})
    return found


@pytest.mark.parametrize(
    ("payoff", "weights"),
    [
        ("own", {"rise": 1.0, "energy": 1.0}),
        ("wet", {"rise": 2.0}),
        ({"rise": 3.0, "energy": -0.5}, {"rise": 3.0, "energy": -0.5}),
    ],
    ids=str,
)
def test_the_growth_of_each_metric_counts_by_its_weight_in_every_episode(payoff: Any, weights: Any) -> None:
    game = started(payoff)
    assert dict(game.terms) == weights
    assert (game.objective is None) == (payoff == "own") == is_own(game.config)
    some = np.array([True, False, True])
    paid = [game.advance(OPEN, EVERYONE, 2), game.advance(OPEN, some, 1)]
    assert paid[1][1] == 0.0
    metrics = game.metrics()
    expected = sum(weight * metrics[name] for name, weight in weights.items())
    np.testing.assert_allclose(sum(paid), expected, rtol=1e-9)
    game.reset(some, [np.random.default_rng(9)] * 3)
    kept = game.metrics()["rise"].copy(), game.metrics()["energy"].copy()
    fresh = game.advance(OPEN, EVERYONE, 1)  # counts from 0 where an episode has begun, and goes on elsewhere
    before = np.where(some, 0.0, kept[0]), np.where(some, 0.0, kept[1])
    grown = {name: game.metrics()[name] - old for name, old in zip(("rise", "energy"), before, strict=True)}
    np.testing.assert_allclose(fresh, sum(weight * grown[name] for name, weight in weights.items()), rtol=1e-9)


def test_a_function_is_asked_in_every_game_step_of_what_has_grown_in_it() -> None:
    CALLS.clear()
    game = started(excess)
    assert game.terms == ()
    alive = np.array([True, False, True])
    inflow = game.inflow
    paid = game.advance(OPEN, alive, 3)
    rise, energy = inflow * [1, 1, 2], 0.01 * (1 + 4)
    np.testing.assert_allclose(paid, np.where(alive, 3 * (np.maximum(rise - 0.3, 0) - energy), 0.0), rtol=1e-9)
    assert len(CALLS) == 3
    assert CALLS[0].keys() == game.metrics().keys()
    np.testing.assert_allclose(CALLS[2]["rise"], np.where(alive, rise, 0.0))
    assert game.objective is not None
    assert game.objective.formula == "excess(increments of the metrics)"


def test_what_is_paid_is_said_as_a_formula() -> None:
    game = started({"rise": 1.0, "energy": -0.5})
    assert game.objective is not None
    assert game.objective.formula == "-0.5 energy + rise"
    assert foreign_pay("tank", game.config).startswith("payoff is not the one that tank itself counts")
    assert foreign_pay("tank", TankConfig()) == foreign_pay("toy", ToyConfig()) == ""
    assert weights_of(TankConfig()) is weights_of(ToyConfig()) is None
    assert weights_of(configured("wet")) == (("rise", 2.0),)
    assert weights_of(configured(excess)) is excess
    assert weights_of(configured("a:b")) == "a:b"
    assert is_own(ToyConfig())


@pytest.mark.parametrize("weight", [1e9, -1e9, 1, 0.5])
def test_weights_may_be_large_whole_or_negative(weight: float) -> None:
    assert configured({"rise": weight, "energy": 0}).payoff == (("energy", 0), ("rise", weight))


@pytest.mark.parametrize(
    ("payoff", "message"),
    [
        ({"rise": 1.1e9}, r"payoff: the weight of rise is 1100000000.0, but must be a number within \+-1e\+09"),
        ({"rise": -1.1e9}, "weight of rise"),
        ({"rise": float("inf")}, "weight of rise"),
        ({"rise": 1.0, "energy": True}, "weight of energy is True"),
        ({"rise": "1"}, "weight of rise is '1'"),
        ({"rise": 0.0, "energy": 0}, "pays nothing: give a metric a weight other than 0"),
        ("wett", "is not one of own, wet. Did you mean 'wet'.*Weights of metrics are written"),
        (None, "must be one of own, wet; weights of metrics"),
        (("rise", "energy"), "must be one of own, wet; weights of metrics"),
        ((("rise", 1.0, 2.0),), "must be one of own, wet; weights of metrics"),
        ([["rise", 1.0], 3], "must be one of own, wet; weights of metrics"),
    ],
    ids=str,
)
def test_what_cannot_be_paid_is_refused(payoff: Any, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        configured(payoff)


@pytest.mark.parametrize(
    ("payoff", "error", "message"),
    [
        ({"rize": 1.0}, ConfigurationError, "payoff: there is no metric 'rize' .* Did you mean 'rise'"),
        (lambda grown: grown["rize"], ConfigurationError, "payoff: there is no metric 'rize'. Did you mean 'rise'"),
        (lambda grown: {}[()], ConfigurationError, "there is no metric"),
        (lambda grown: 1 / 0, ConfigurationError, "the function failed: ZeroDivisionError: division by zero"),
        (lambda grown: grown["rise"][:2], ConfigurationError, r"return 3 finite numbers.*and returned array\(\[0"),
        (lambda grown: grown["rise"] * np.nan, ConfigurationError, "return 3 finite numbers"),
        (lambda grown: 1.0, ConfigurationError, "return 3 finite numbers"),
        ("json:nothing", UnknownNameError, "no function can be imported from 'json:nothing'"),
        ("json:decoder", ConfigurationError, "'json:decoder' is no function but"),
        ("no_such_module:f", UnknownNameError, "no function can be imported"),
    ],
)
def test_a_function_or_a_metric_that_fails_is_named(
    payoff: Any, error: type[Exception], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cps_envs.core.game.objective.require_trust", lambda text: None)
    with pytest.raises(error, match=message):
        started(payoff).advance(OPEN, EVERYONE, 1)


def test_a_text_that_names_a_function_is_imported_with_consent_only(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def refuse(text: str) -> None:
        asked.append(text)
        raise UntrustedCodeError("no")

    monkeypatch.setattr("cps_envs.core.game.objective.require_trust", refuse)
    with pytest.raises(UntrustedCodeError):
        started(f"{__name__}:excess")
    assert asked == [f"{__name__}:excess"]
    monkeypatch.setattr("cps_envs.core.game.objective.require_trust", asked.append)
    game = started(f"{__name__}:excess")
    assert game.objective is not None
    assert game.objective.function is not None
    assert game.objective.function.__name__ == "excess"


def test_a_metric_that_is_not_finite_is_named_and_nothing_else() -> None:
    paid = Objective((("a", 1.0), ("b", 2.0)), {"a": np.zeros(2), "b": np.zeros(2)})
    both = np.ones(2, np.bool_)
    with pytest.raises(ConfigurationError, match="payoff: the metric 'b' is not finite yet, so it cannot be paid"):
        paid.pay({"a": np.zeros(2), "b": np.array([1.0, np.nan])}, both)
    first = Objective((("b", 2.0),), {"a": np.zeros(2), "b": np.zeros(2)})
    found = first.pay({"a": np.zeros(2), "b": np.array([1.0, np.inf])}, np.array([True, False]))
    assert found.tolist() == [2.0, 0.0]
