"""How often 95 % intervals hold a truth that is known: docs/evaluation.md shows what `-s` prints here."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from cps_agents.arena.statistics import Estimate, difference, estimate
from cps_agents.league.equilibrium import game_value
from cps_envs.core.types import FloatArray

PAGE = Path(__file__).parents[2] / "docs" / "evaluation.md"
REPETITIONS, RESAMPLES = 1000, 600
CRASHES, FAILING = 0.05, 0.2  # shares: of episodes that pay much, of training seeds that are 5 below the others

Noise = Callable[[np.random.Generator, tuple[int, ...]], FloatArray]
Draw = Callable[[np.random.Generator], Estimate]


def crashes(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """One of twenty episodes pays much, the others nothing: mean 0, deviation 1."""
    found: FloatArray = ((generator.random(shape) < CRASHES) - CRASHES) / np.sqrt(CRASHES * (1 - CRASHES))
    return found


def failing(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """One of five is far below the others, which are equal: mean 0, deviation 1."""
    found: FloatArray = (FAILING - (generator.random(shape) < FAILING)) / np.sqrt(FAILING * (1 - FAILING))
    return found


def normal(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    found: FloatArray = generator.normal(size=shape)
    return found


def scores(
    generator: np.random.Generator, seeds: int, luck: float, common: FloatArray, kind: Noise = normal
) -> FloatArray:
    """Returns (seeds, episodes) of a policy of mean 0: a seed's luck, what episodes share, and noise of deviation 1."""
    by_seed = luck * kind(generator, (seeds, 1))
    found: FloatArray = by_seed + common + generator.normal(size=(seeds, common.shape[1]))
    return found


def mean_of(generator: np.random.Generator, *, luck: float, kind: Noise) -> Estimate:
    common = generator.normal(size=(1, 50))
    return estimate([scores(generator, 5, luck, common, kind)], resamples=RESAMPLES)


def mean_of_crashes(generator: np.random.Generator) -> Estimate:
    return estimate([crashes(generator, (1, 10))], resamples=RESAMPLES)


def difference_of(generator: np.random.Generator, *, others: int, luck: float) -> Estimate:
    common = generator.normal(size=(1, 50))
    one, other = (scores(generator, seeds, luck, common) for seeds in (5, others))
    return difference([one], [other], resamples=RESAMPLES)


def value_of(generator: np.random.Generator) -> Estimate:
    return game_value(generator.normal(size=(10, 4, 10)))


CASES: dict[str, tuple[Draw, float]] = {  # with the share of intervals that hold 0, as on the page
    "5 seeds x 50 episodes": (partial(mean_of, luck=1.0, kind=normal), 0.944),
    "5 x 50, one training seed in five fails": (partial(mean_of, luck=2.0, kind=failing), 0.676),
    "1 x 10, crashes": (mean_of_crashes, 0.4),
    "trained 5 seeds v trained 5, 50 episodes, seeds differ much": (partial(difference_of, others=5, luck=2.0), 0.952),
    "trained 5 seeds v trained 1, 50 episodes": (partial(difference_of, others=1, luck=0.5), 0.671),
    "10 x 4 equal policies, 10 episodes": (value_of, 1.0),  # .30 where strategies are valued on what chose them
}


@pytest.mark.slow
@pytest.mark.parametrize("title", CASES)
def test_intervals_hold_the_truth_as_often_as_the_page_says(title: str) -> None:
    draw, published = CASES[title]
    seed = zlib.crc32(title.encode())
    found = [draw(np.random.default_rng([seed, number])) for number in range(REPETITIONS)]
    ends = np.array([[each.low, each.high] for each in found], np.float64)
    share = ((ends[:, 0] <= 0) & (ends[:, 1] >= 0)).mean()
    print(f"| {title} | {share:.1%} |")
    assert share == pytest.approx(published, abs=0.005)
    assert f"| {title} | {published:.1%} |" in PAGE.read_text(encoding="utf-8")
