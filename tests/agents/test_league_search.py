"""Searching the numbers of a policy: it finds what there is to find, and ends with its budget."""

from __future__ import annotations

from collections.abc import Mapping
from urllib.parse import parse_qsl

import numpy as np
import pytest

from cps_agents.league.search import run_search, with_options
from cps_baselines.searches import SearchSpace
from cps_envs.core.types import FloatArray


def place_of(policy: str) -> dict[str, float]:
    return {name: float(text) for name, text in parse_qsl(policy.partition("?")[2])}


@pytest.mark.parametrize("ranges", [{"x": (0.0, 10.0)}, {"x": (0.0, 10.0), "y": (-1.0, 1.0), "z": (100.0, 900.0)}])
def test_a_search_finds_the_top_of_a_hill(ranges: Mapping[str, tuple[float, float]]) -> None:
    tried: list[range] = []

    def score(policy: str, seeds: range) -> FloatArray:
        tried.append(seeds)
        places = place_of(policy)
        shares = [(places[name] - low) / (high - low) for name, (low, high) in ranges.items()]
        return np.full(len(seeds), -sum((share - 0.8) ** 2 for share in shares))

    found = run_search(SearchSpace("hill", "plan?far=1", ranges), score, 1.0, 4, 1000)  # type: ignore[arg-type]
    assert found.policy.startswith("plan?far=1&x=")
    assert found.score > -1e-2
    assert found.candidates == len(tried)
    assert found.episodes == sum(map(len, tried))
    assert min(seeds.start for seeds in tried) == 1000
    assert len({seeds.start for seeds in tried}) > 3  # fresh episodes in each generation


def test_a_search_ends_with_its_budget_and_has_a_result_however_small_that_is() -> None:
    def score(policy: str, seeds: object) -> FloatArray:
        return np.zeros(2)

    found = run_search(SearchSpace("flat", "plan", {"x": (0.0, 1.0)}, {"x": 0.25}), score, 1e-9, 2, 0)
    assert found.policy == "plan?x=0.25"
    assert run_search(SearchSpace("nothing", "plan", {}), score, 1e-9, 2, 0).policy == "plan"


def test_options_are_written_so_that_they_can_be_read() -> None:
    assert with_options("a?b=1", {"c": 12345678.0, "d": 0.000012345}) == "a?b=1&c=12350000&d=0.00001234"
    assert with_options("a", {}) == "a"
