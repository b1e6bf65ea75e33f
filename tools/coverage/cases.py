"""What `python -m tools.coverage` simulates: data of the shapes of evaluations and leagues, from known distributions.

So the truth of each simulated measurement is known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cps_agents.arena.statistics import ONE_SEED, Estimate, Statistic, difference, estimate, interquartile_mean, mean
from cps_agents.league.equilibrium import game_value, solve
from cps_envs.core.types import FloatArray


class Outcome(NamedTuple):
    """One repetition."""

    found: Estimate
    truth: float


Draw: TypeAlias = Callable[[np.random.Generator, int], Outcome]  # called with the number of resamples


@dataclass(frozen=True)
class Case:
    """What is drawn again and again; `draw` is a partial of a module's function, so that processes can call it."""

    group: str
    title: str
    draw: Draw
    note: str = ""  # beside the figures


@dataclass(frozen=True)
class Coverage:
    """How the intervals of a case did."""

    group: str
    title: str
    note: str
    repetitions: int
    held: int  # intervals that hold the truth
    above: int  # intervals that lie above it
    below: int
    bias: float  # mean of the estimates minus the truth
    length: float  # mean of the intervals
    cpu_s: float

    @property
    def share(self) -> float:
        """Of the intervals that hold the truth."""
        return self.held / self.repetitions

    @property
    def standard_error(self) -> float:
        """Of the share."""
        return float(np.sqrt(self.share * (1 - self.share) / self.repetitions))


Noise: TypeAlias = Callable[[np.random.Generator, tuple[int, ...]], FloatArray]  # mean 0, deviation 1
CRASHES = 0.05  # share of episodes
FAILING = 0.2  # share of training seeds


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


def failing(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """One of five is far below the others, which are equal."""
    found: FloatArray = (FAILING - (generator.random(shape) < FAILING)) / np.sqrt(FAILING * (1 - FAILING))
    return found


@dataclass(frozen=True)
class Spread:
    """Standard deviations of what training seeds, episodes, and both together add."""

    seed: float
    episode: float
    noise: float
    kind: Noise = normal  # of the episodes and of the noise
    luck: Noise = normal  # of the training seeds


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
    truth = 0.0 if statistic is mean else _middle(spread)
    return Outcome(estimate([values], statistic, resamples=resamples), truth)


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


@lru_cache
def _middle(spread: Spread) -> float:
    """The interquartile mean of endless training seeds and episodes; 0 where all is symmetric."""
    if spread.luck is normal:
        return 0.0
    generator, size = np.random.default_rng(0), (MANY, 1)
    values = _scores(generator, MANY, spread, spread.episode * spread.kind(generator, size))
    return float(interquartile_mean([values]))


def _scores(generator: np.random.Generator, seeds: int, spread: Spread, episodes: FloatArray) -> FloatArray:
    by_seed = spread.seed * spread.luck(generator, (seeds, 1))
    found: FloatArray = by_seed + episodes + spread.noise * spread.kind(generator, (seeds, episodes.shape[1]))
    return found


MANY = 1_000_000  # draws behind a truth that has no formula
MEANS, MIDDLES, STRATA = "mean of a policy", "interquartile mean", "mean over settings"
DIFFERENCES, VALUES = "paired difference, none in truth", "value of a game"
FAIL = Spread(2.0, 1.0, 1.0, luck=failing)
FAIL_NOTE = "a seed that fails is 5 below the others; where none did, the interval is short and too high"
SMALL = Spread(0.5, 1.0, 1.0)  # the luck of training is half as large as that of an episode
ROCK_PAPER_SCISSORS = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])


def all_cases() -> list[Case]:
    """Every case, group by group."""
    return [*_means(), *_middles(), *_strata(), *_differences(), *_values()]


def _means() -> Iterator[Case]:
    for seeds, episodes in ((10, 50), (5, 50), (3, 20), (2, 50), (2, 10)):
        yield _mean(f"{seeds} seeds x {episodes} episodes", seeds, episodes, EVEN)
    yield _mean("5 x 50, only seeds differ", 5, 50, Spread(1.0, 0.0, 0.0))
    yield _mean("5 x 50, only episodes differ", 5, 50, Spread(0.0, 1.0, 0.0))
    yield _mean("5 x 50, all is noise", 5, 50, Spread(0.0, 0.0, 1.0), "longer than it had to be")
    for kind, note in ((skewed, ""), (crashes, "one of 20 episodes pays: too rare for so few")):
        for episodes in (50, 10):
            yield _mean(f"1 x {episodes}, {kind.__name__}", 1, episodes, Spread(0.0, 1.0, 0.0, kind), note)
    yield _mean("5 x 50, crashes", 5, 50, Spread(0.5, 0.5, 1.0, crashes))
    for seeds in (3, 5, 10):
        yield _mean(f"{seeds} x 50, one training seed in five fails", seeds, 50, FAIL, FAIL_NOTE)


def _mean(title: str, seeds: int, episodes: int, spread: Spread, note: str = "") -> Case:
    return Case(MEANS, title, partial(single, seeds=seeds, episodes=episodes, spread=spread), note)


def _middles() -> Iterator[Case]:
    for kind in (normal, heavy):
        spread = Spread(0.5, 1.0, 1.0, kind)
        draw = partial(single, seeds=5, episodes=50, spread=spread, statistic=interquartile_mean)
        yield Case(MIDDLES, f"5 x 50, {kind.__name__} noise", draw)
    draw = partial(single, seeds=5, episodes=50, spread=FAIL, statistic=interquartile_mean)
    yield Case(MIDDLES, "5 x 50, interquartile, one training seed in five fails", draw, FAIL_NOTE)


def _strata() -> Iterator[Case]:
    for shared, title in ((False, "a seed's luck differs in each"), (True, "a seed is as good in all")):
        draw = partial(strata, count=3, seeds=5, episodes=20, spread=SMALL, shared=shared)
        yield Case(STRATA, f"3 settings of 5 x 20, {title}", draw)


def _differences() -> Iterator[Case]:
    for seeds, others, episodes in ((5, 5, 50), (3, 3, 20), (5, 2, 50), (2, 2, 50)):
        yield _difference(f"trained {seeds} seeds v trained {others}, {episodes} episodes", seeds, others, episodes)
    title = "trained 5 seeds v trained 5, 50 episodes, seeds differ much"
    yield _difference(title, 5, 5, 50, spread=Spread(2.0, 1.0, 1.0))
    yield _difference("trained 5 seeds v analytic, 50 episodes", 5, 1, 50, trained=False)
    yield _difference("analytic v analytic, 50 episodes", 1, 1, 50, spread=Spread(0.0, 1.0, 1.0))
    yield _difference("trained 5 seeds v trained 1, 50 episodes", 5, 1, 50, note=f"marked in tables: {ONE_SEED}")


def _difference(
    title: str,
    seeds: int,
    others: int,
    episodes: int,
    *,
    spread: Spread = SMALL,
    trained: bool = True,
    note: str = "",
) -> Case:
    draw = partial(pair, seeds=seeds, baseline_seeds=others, episodes=episodes, spread=spread, trained=trained)
    return Case(DIFFERENCES, title, draw, note)


def _values() -> Iterator[Case]:
    for episodes in (10, 50):
        for rows, columns in ((10, 4), (2, 1), (20, 1), (20, 20)):
            yield _value(f"{rows} x {columns} equal policies", episodes, means=np.zeros((rows, columns)))
        yield _value("rock, paper, scissors", episodes, means=ROCK_PAPER_SCISSORS)
        for size in (5, 20):
            yield _value(f"{size} x {size}, means drawn", episodes, shape=(size, size))
    yield _value("20 x 20 equal policies, skewed noise", 10, skewed, means=np.zeros((20, 20)))
    yield _value("20 x 1 equal policies, skewed noise", 10, skewed, means=np.zeros((20, 1)))
    yield _value("5 x 5, means drawn, crashes", 50, crashes, shape=(5, 5))
    yield _value("5 x 5, means drawn, seeds shared", 10, shape=(5, 5), shared=3.0)


def _value(title: str, episodes: int, kind: Noise = normal, **options: Any) -> Case:
    return Case(VALUES, f"{title}, {episodes} episodes", partial(game, episodes=episodes, kind=kind, **options))
