"""Mixed strategies as references."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_agents.league.strategy import Strategy, mix
from cps_envs import find_problem
from cps_envs.core.policies.mixture import Mixture

texts = st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1, max_size=12)
names = texts.filter(lambda text: "?" not in text and text.rpartition(".")[2] != "mixture") | texts.map(
    "zoo:{}/x".format
)
pools = st.lists(st.tuples(names, st.integers(1, 1000)), min_size=1, max_size=5, unique_by=lambda pair: pair[0])


@given(pools)
def test_a_reference_gives_its_strategy_back(pool: list[tuple[str, int]]) -> None:
    policies, weights = zip(*pool, strict=True)
    made = mix(policies, weights)
    again = mix([made.reference])
    assert again.policies == policies == made.policies
    np.testing.assert_allclose(again.probabilities, np.array(weights) / sum(weights), atol=3e-6)


def test_the_environments_read_the_reference() -> None:
    problem = find_problem("rogue")
    game = problem.game(problem.config("paper", {}), 1)
    made: Any = problem.policy(mix(["square?frequency_hz=0.12&duty=0.4", "none"], [3, 1]).reference, game, "attacker")
    assert isinstance(made, Mixture)
    np.testing.assert_allclose(made.probabilities, [0.75, 0.25])
    square: Any = made.policies[0]
    assert (square.frequency_hz.item(), square.duty.item()) == (0.12, 0.4)


def test_mixtures_of_mixtures_are_taken_apart() -> None:
    inner = mix(["a", "b?x=1&y=2"], [1, 3]).reference
    found = mix([inner, "c", "a"], [2, 1, 1])
    assert dict(zip(found.policies, found.probabilities, strict=True)) == pytest.approx(
        {"a": 0.125 + 0.25, "b?x=1&y=2": 0.375, "c": 0.25}
    )
    assert mix(['rogue.attacker.mixture?policies=["a","b"]']).probabilities == (0.5, 0.5)


def test_a_pure_strategy_is_its_policy() -> None:
    assert mix(["pd"]).reference == "pd"
    assert mix(["pd", "sliding"], [1, 0]).reference == "pd"
    assert mix(["pd", "sliding"], [1, 1e-9]) == Strategy(("pd",), (1.0,))


@pytest.mark.parametrize("weights", [[1], [1, -1], [0, 0], [1, float("nan")]])
def test_weights_that_make_no_sense(weights: list[float]) -> None:
    with pytest.raises(ValueError, match="weight"):
        mix(["a", "b"], weights)


@pytest.mark.parametrize("reference", ["mixture", "mixture?policies=a", 'mixture?policies=["a"]&weights=[1,2]'])
def test_references_that_are_no_mixtures(reference: str) -> None:
    with pytest.raises(ValueError, match="write mixture"):
        mix([reference])
