"""The value of a game of noisy means: unbiased, and its interval holds the true one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")

from scipy import stats

from cps_agents.arena.statistics import Estimate
from cps_agents.league.equilibrium import game_value, guaranteed, solve
from tests.agents.test_league_equilibrium import PENNIES, ROCK_PAPER_SCISSORS

Games = Callable[[np.random.Generator], np.ndarray[Any, Any]]


def equal(rows: int, columns: int) -> Games:
    return lambda generator: np.zeros((rows, columns))


def normal(rows: int, columns: int) -> Games:
    return lambda generator: generator.normal(size=(rows, columns))


@pytest.mark.parametrize(
    ("games", "episodes"),
    [
        (equal(20, 1), 10),  # 10 x 4: tests/tools/test_coverage.py
        (equal(20, 20), 50),
        (lambda generator: ROCK_PAPER_SCISSORS, 10),
        (normal(20, 20), 10),
    ],
)
def test_the_interval_holds_the_true_value_and_the_mean_is_unbiased(games: Games, episodes: int) -> None:
    generator, hits, errors, trials = np.random.default_rng(1), 0, [], 60
    for _ in range(trials):
        means = games(generator)
        value = solve(means).value
        found = game_value(means[:, :, None] + generator.normal(size=(*means.shape, episodes)))
        assert found.low is not None
        assert found.high is not None
        assert found.low <= found.mean <= found.high
        hits += found.low <= value <= found.high
        errors.append(found.mean - value)
    assert hits / trials >= 0.9
    assert abs(np.mean(errors)) <= 4 * np.std(errors) / np.sqrt(trials)


def test_means_alone_would_favour_the_side_with_more_policies() -> None:
    generator = np.random.default_rng(2)
    found = [solve(generator.normal(size=(10, 4, 10)).mean(axis=2)).value for _ in range(50)]
    assert np.mean(found) > 0.1


def test_noise_that_all_meetings_share_moves_the_value_by_its_mean() -> None:
    episodes = PENNIES[:, :, None] + np.random.default_rng(0).normal(size=(1, 1, 400))
    found = game_value(episodes)
    assert found.low is not None
    assert found.high is not None
    assert found.mean == pytest.approx(episodes[0, 0].mean() - 1)
    assert found.high - found.low == pytest.approx(2 * 1.96 / 20, rel=0.1)
    assert game_value(episodes) == found


def test_episodes_that_are_all_the_same_leave_no_doubt() -> None:
    found = game_value(np.repeat(PENNIES[:, :, None], 3, axis=2))
    assert (found.mean, found.low, found.high) == pytest.approx((0.0, 0.0, 0.0))


def test_what_is_guaranteed_is_the_least_and_the_most() -> None:
    paid, conceded = np.array([[1.0, 1.0], [0.5, 0.5]]), np.array([[2.0, 2.0], [3.0, 3.0]])
    found = guaranteed(paid, conceded, np.array([1.5, 1.5]))
    assert (found.mean, found.low, found.high) == (1.5, 0.5, 3.0)


def test_a_single_episode_has_a_value_and_no_interval() -> None:
    found = game_value(PENNIES[:, :, None])
    assert (found.mean, found.low, found.high, found.seeds, found.episodes) == (0.0, None, None, 1, 1)
    assert game_value(np.dstack([PENNIES, 2 * PENNIES])).low is not None
    assert guaranteed(np.zeros((2, 1)), np.ones((2, 1)), np.full(1, 0.5)) == Estimate(0.5, None, None, 1, 1)


def test_nobody_chooses_on_the_episodes_that_it_is_valued_on() -> None:
    lucky = np.full((2, 1, 10), 5.0)
    lucky[0, 0, ::2] = lucky[1, 0, 1::2] = 6.0  # each row wins in one half of the episodes
    assert game_value(lucky).mean == 5.0


def test_limits_are_student_s() -> None:
    generator = np.random.default_rng(3)
    paid, conceded = generator.normal(size=(3, 12)), generator.normal(5.0, 1.0, size=(2, 12))
    found = guaranteed(paid, conceded, np.full(12, 2.0), level=0.9)
    ends = [stats.ttest_1samp(values, 0.0, axis=1).confidence_interval(0.9) for values in (paid, conceded)]
    assert found.low == pytest.approx(ends[0].low.min())
    assert found.high == pytest.approx(ends[1].high.max())
