"""The boards that are shipped: two halves of the episodes rank the entries alike; what does not look stays at zero."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the baselines")

from cps_agents.scoring.board import entries
from cps_agents.scoring.score import Score
from cps_baselines.tracks import find_track, tracks


def half(score: Score, first: int) -> float:
    """The score in every other episode."""
    return float(np.mean([values[:, first::2].mean(axis=1).mean() for values in score.strata]))


def test_two_halves_of_the_episodes_rank_entries_alike() -> None:
    agreed = []
    for name in tracks():
        above = [score for score in entries(find_track(name)).values() if score.estimate.mean > 0]
        for one, two in combinations(above, 2):
            if one.minus(two).excludes_zero:  # others share a rank
                agreed.append(np.sign(half(one, 0) - half(two, 0)) * np.sign(half(one, 1) - half(two, 1)))
    assert len(agreed) > 10
    assert np.mean(agreed) >= 0.9  # Kendall's tau over the pairs of all tracks


def test_what_does_not_look_stays_at_zero() -> None:
    found = [(name, score) for track in tracks() for name, score in entries(find_track(track)).items()]
    idle = [score for name, score in found if name in ("none", "random", "constant")]
    assert len(idle) >= 8
    for score in idle:
        assert score.estimate.mean <= score.half_width, score.line
