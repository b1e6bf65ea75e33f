"""Data of the shapes that evaluations and leagues have, from known distributions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cps_agents.arena.statistics import Statistic, difference, estimate, mean
from cps_agents.coverage.case import Outcome
from cps_agents.league.equilibrium import solve
from cps_agents.league.value import game_value
from cps_envs.core.types import FloatArray

Noise: TypeAlias = Callable[[np.random.Generator, tuple[int, ...]], FloatArray]  # mean 0, deviation 1
CRASHES = 0.05  # share of episodes


def normal(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """Normal noise."""
    found: FloatArray = generator.normal(size=shape)
    return found


def skewed(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """Exponential noise."""
    found: FloatArray = generator.exponential(size=shape) - 1
    return found


def heavy(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """Student's t of three degrees of freedom."""
    found: FloatArray = generator.standard_t(3, size=shape) / np.sqrt(3)
    return found


def crashes(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """One of twenty episodes pays much, the others nothing."""
    found: FloatArray = ((generator.random(shape) < CRASHES) - CRASHES) / np.sqrt(CRASHES * (1 - CRASHES))
    return found


@dataclass(frozen=True)
class Spread:
    """Standard deviations of what training seeds, episodes, and both together add."""

    seed: float
    episode: float
    noise: float
    kind: Noise = normal  # of the episodes and of the noise


EVEN = Spread(1.0, 1.0, 1.0)


def single(
    generator: np.random.Generator,
    resamples: int,
    *,
    seeds: int,
    episodes: int,
    spread: Spread = EVEN,
    statistic: Statistic = mean,
) -> Outcome:
    """A policy of mean 0, every seed in the same episodes."""
    values = _scores(generator, seeds, spread, _episodes(generator, episodes, spread))
    return Outcome(estimate([values], statistic, resamples=resamples), 0.0)


def strata(
    generator: np.random.Generator,
    resamples: int,
    *,
    count: int,
    seeds: int,
    episodes: int,
    spread: Spread,
    shared: bool,
) -> Outcome:
    """The mean over settings; a seed is as good in all of them, or its luck is another in each."""
    by_seed = spread.seed * generator.normal(size=(1 if shared else count, seeds, 1)).repeat(count if shared else 1, 0)
    rest = Spread(0.0, spread.episode, spread.noise, spread.kind)
    values = [own + _scores(generator, seeds, rest, _episodes(generator, episodes, rest)) for own in by_seed]
    return Outcome(estimate(values, resamples=resamples), 0.0)


def pair(
    generator: np.random.Generator,
    resamples: int,
    *,
    seeds: int,
    baseline_seeds: int,
    episodes: int,
    spread: Spread,
    trained: bool = True,
) -> Outcome:
    """Two policies without a true difference; an analytic baseline has no training seeds, and so no luck in them."""
    common = _episodes(generator, episodes, spread)
    other = spread if trained else Spread(0.0, spread.episode, spread.noise, spread.kind)
    first, second = _scores(generator, seeds, spread, common), _scores(generator, baseline_seeds, other, common)
    return Outcome(difference([first], [second], resamples=resamples), 0.0)


def game(
    generator: np.random.Generator,
    resamples: int,
    *,
    means: FloatArray | None = None,
    shape: tuple[int, int] = (0, 0),
    episodes: int,
    kind: Noise = normal,
    shared: float = 0.0,
) -> Outcome:
    """A league of these true means, drawn anew if there are none; every meeting has noise of deviation 1 in an episode.

    `shared` is the deviation of what an episode adds to every meeting.
    """
    truth = generator.normal(size=shape) if means is None else means
    common = shared * kind(generator, (1, 1, episodes))
    payoffs = truth[:, :, np.newaxis] + kind(generator, (*truth.shape, episodes)) + common
    return Outcome(game_value(payoffs), solve(truth).value)


def _episodes(generator: np.random.Generator, episodes: int, spread: Spread) -> FloatArray:
    return spread.episode * spread.kind(generator, (1, episodes))


def _scores(generator: np.random.Generator, seeds: int, spread: Spread, episodes: FloatArray) -> FloatArray:
    by_seed = spread.seed * generator.normal(size=(seeds, 1))
    found: FloatArray = by_seed + episodes + spread.noise * spread.kind(generator, (seeds, episodes.shape[1]))
    return found
