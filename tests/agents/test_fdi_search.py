"""The recipes that search the policies of the FDI duel: what counts, and against whom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_agents.learning.recipe import count_episodes
from cps_agents.learning.search import family_of, play_scenes
from tools.recipes.fdi import FALSE_ALARM_MPS, HONEST_ALARM_MPS, FdiHypotheses, FdiTaskTracker


@pytest.mark.parametrize("recipe", [FdiHypotheses(), FdiTaskTracker()])
def test_every_scene_can_be_played(recipe: Any) -> None:
    family = family_of(recipe)
    reached = play_scenes(recipe, family, family.values(np.zeros((1, len(family.numbers)))), 2_000_000)
    assert reached.shape == (1, count_episodes(recipe.scenes))
    assert np.isfinite(reached).all()


def test_a_false_alarm_costs_more_where_nobody_attacks() -> None:
    outcome = {
        "return": np.array([0.1, 0.1, 0.1]),
        "false_alarm": np.array([0.0, 1.0, 1.0]),
        "attacked": np.array([1.0, 1.0, 0.0]),
        "smallest_gap_m": np.array([0.2, 0.2, 3.0]),
    }
    expected = -0.1 - np.array([0.0, FALSE_ALARM_MPS, HONEST_ALARM_MPS])
    np.testing.assert_allclose(FdiHypotheses().values(outcome), expected)


def test_a_small_gap_costs_where_nobody_attacks() -> None:
    quiet = {"return": np.zeros(2), "false_alarm": np.zeros(2), "attacked": np.zeros(2)}
    assert FdiHypotheses().values({**quiet, "smallest_gap_m": np.array([2.0, 0.5])}).tolist() == [0.0, -2.0]
