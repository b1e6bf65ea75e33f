"""Means with 95 % intervals over training seeds and evaluation episodes, and paired differences.

The data of a policy are one array (S, E) for each stratum: S training seeds, which play the same E episodes. Strata are
a fixed list, such as tasks, that counts as it is and is not drawn from. A bootstrap resample draws training seeds, the
same ones in all strata since they are the same networks, and in each stratum episodes; both with replacement, crossed
(Owen 2007, The pigeonhole bootstrap). Where training seeds are one or episodes are one, that factor is not resampled:
the interval then says nothing about it.

The percentile interval of few values is too short: with five it holds the mean of normal data in 84 of 100 cases.
So it is stretched about the estimate by what Student's t asks beyond the normal distribution, with Satterthwaite's
degrees of freedom for seeds and episodes together. Where neither seeds nor episodes have an effect and all is noise,
the interval is longer than it had to be.

A difference of two policies has three factors: the training seeds of one, those of the other, and the episodes, which
both play. All are drawn. docs/evaluation.md shows how often intervals hold the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray, IntArray

LEVEL = 0.95
RESAMPLES = 4000
CHUNK = 200_000  # numbers resampled at a time
Strata: TypeAlias = Sequence[FloatArray]
Statistic: TypeAlias = Callable[[Sequence[FloatArray]], FloatArray]  # strata (R, S, E) -> (R,)
ONE_SEED = "one training seed: its seed noise is not in the interval"  # of a trained baseline


@dataclass(frozen=True)
class Estimate:
    """A mean with its interval; without one where there is a single training seed and a single episode."""

    mean: float
    low: float | None
    high: float | None
    seeds: int  # training seeds
    episodes: int  # of each, in all strata

    def __format__(self, spec: str) -> str:
        """The mean, and its interval in brackets where there is one."""
        ends = "" if self.low is None or self.high is None else f" ({self.low:{spec}} to {self.high:{spec}})"
        return f"{self.mean:{spec}}{ends}"

    @property
    def excludes_zero(self) -> bool:
        """Whether the interval lies on one side of zero."""
        return self.low is not None and self.high is not None and (self.low > 0 or self.high < 0)


def mean(strata: Sequence[FloatArray]) -> FloatArray:
    """The mean over strata of their means; (R,) for arrays (R, S, E)."""
    found: FloatArray = np.mean([values.mean(axis=(-2, -1)) for values in strata], axis=0)
    return found


def interquartile_mean(strata: Sequence[FloatArray]) -> FloatArray:
    """The mean of the middle half of all scores together; (R,) for arrays (R, S, E)."""
    flat = [values.reshape(*values.shape[:-2], -1) for values in strata]
    scores = np.sort(np.concatenate(flat, axis=-1), axis=-1)
    cut = scores.shape[-1] // 4
    found: FloatArray = scores[..., cut : scores.shape[-1] - cut].mean(axis=-1)
    return found


def estimate(
    strata: Strata, statistic: Statistic = mean, *, resamples: int = RESAMPLES, level: float = LEVEL, seed: int = 0
) -> Estimate:
    """A statistic of arrays (S, E) with its bootstrap interval. Same data, same `seed`: the same interval.

    Raises:
        ValueError: no data, different numbers of training seeds, or values that are not finite.
    """
    strata = _checked(strata)
    (strata,) = _in_order([strata])
    return _estimate([strata], statistic, resamples, level, seed)


def difference(
    learned: Strata,
    baseline: Strata,
    factor: float = 1.0,
    *,
    resamples: int = RESAMPLES,
    level: float = LEVEL,
    seed: int = 0,
) -> Estimate:
    """The mean of `learned` - `factor` x `baseline` with its interval, episode by episode on the same seeds.

    Training seeds of the baseline are drawn too; where it has only one, the interval cannot know their noise
    (`ONE_SEED`). Where one side played more episodes, the first ones that both played count; a single episode, of an
    arena and policies that draw nothing, stands for all. `seeds` of the result are those of `learned`.

    Raises:
        ValueError: different strata; see also `estimate`.
    """
    if len(learned) != len(baseline):
        raise ValueError(f"{len(learned)} and {len(baseline)} strata cannot be paired")
    shared = [_shared(a, b) for a, b in zip(_checked(learned), _checked(baseline), strict=True)]
    mine, others = _in_order([[a for a, _ in shared], [b for _, b in shared]])
    paired = [a - factor * b[:1] for a, b in zip(mine, others, strict=True)]  # the same for both: exact where both are
    beside = [factor * (b - b[:1]) for b in others]
    return _estimate([paired, beside] if len(others[0]) > 1 else [paired], mean, resamples, level, seed)


def _shared(learned: FloatArray, baseline: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The episodes of a stratum that both played."""
    episodes = learned.shape[1], baseline.shape[1]
    shared = min(episodes) if min(episodes) > 1 else max(episodes)
    first, second = (np.repeat(each, shared, axis=1) if each.shape[1] == 1 else each for each in (learned, baseline))
    return first[:, :shared], second[:, :shared]


def _estimate(sides: Sequence[Strata], statistic: Statistic, resamples: int, level: float, seed: int) -> Estimate:
    """The statistic of the first side, minus that of the second if there is one."""
    origin = sides[0][0][0, 0]  # constant data stay exactly constant
    sides = [[values - origin for values in sides[0]], *sides[1:]]
    found = float(_combined(sides, statistic)[0])
    low = high = None
    seeds, episodes = len(sides[0][0]), sum(values.shape[1] for values in sides[0])
    if len(sides) > 1 or seeds > 1 or any(values.shape[1] > 1 for values in sides[0]):
        drawn = _resampled(sides, statistic, resamples, np.random.default_rng(seed))
        ends = np.quantile(drawn, [(1 - level) / 2, (1 + level) / 2])
        stretched = found + _stretch(sides, level) * (ends - found)
        low, high = (float(end + origin) for end in (min(stretched[0], found), max(stretched[1], found)))
    return Estimate(found + float(origin), low, high, seeds, episodes)


def _combined(sides: Sequence[Strata], statistic: Statistic) -> FloatArray:
    first, *others = (statistic([values.reshape(-1, *values.shape[-2:]) for values in side]) for side in sides)
    found: FloatArray = first - others[0] if others else first
    return found


def _checked(strata: Strata) -> Strata:
    strata = [np.asarray(values, np.float64) for values in strata]
    if not strata or any(values.ndim != 2 or not values.size for values in strata):
        raise ValueError("every stratum needs an array (training seeds, episodes) with something in it")
    if len({len(values) for values in strata}) > 1:
        raise ValueError("every stratum needs the same training seeds")
    if not all(np.isfinite(values).all() for values in strata):
        raise ValueError("scores have to be finite")
    return strata


def _in_order(sides: Sequence[Strata]) -> list[Strata]:
    """The same data, training seeds of each side, and the episodes that all play, sorted by their scores.

    Neither has an order of its own, so the interval must not depend on the one they come in: resamples of a few seeds
    take few values, and an end may jump from one to the next.
    """
    by_seed = [[values[_order(strata)] for values in strata] for strata in sides]
    orders = [_order([values.T for values in group]) for group in zip(*by_seed, strict=True)]
    return [[values[:, order] for values, order in zip(strata, orders, strict=True)] for strata in by_seed]


def _order(arrays: Sequence[FloatArray]) -> IntArray:
    """The order of the rows by their sorted values, first those of the first array."""
    return np.lexsort(np.hstack([np.sort(values, axis=1) for values in arrays]).T[::-1])


def _resampled(
    sides: Sequence[Strata], statistic: Statistic, resamples: int, generator: np.random.Generator
) -> FloatArray:
    """The statistic of resampled data (resamples,)."""
    size = sum(values.size for strata in sides for values in strata)
    parts = []
    for first in range(0, resamples, step := max(CHUNK // size, 1)):
        count = min(step, resamples - first)
        rows = [generator.integers(len(strata[0]), size=(count, len(strata[0]), 1)) for strata in sides]
        columns = [generator.integers(values.shape[1], size=(count, 1, values.shape[1])) for values in sides[0]]
        drawn = [
            [
                values[mine, theirs] if len(values) > 1 else values[0].take(theirs)  # the same, four times as fast
                for values, theirs in zip(strata, columns, strict=True)
            ]
            for strata, mine in zip(sides, rows, strict=True)
        ]
        parts.append(_combined(drawn, statistic))
    return np.concatenate(parts)


def _stretch(sides: Sequence[Strata], level: float) -> float:
    """How much longer the interval has to be than that of the percentiles."""
    stats = require("scipy.stats", extra="baselines", purpose="an interval")
    unbiased = resampled = squares = 0.0
    for values, weight in _factors(sides):
        count = len(values)
        if count > 1:
            part = weight**2 * float(values.var(ddof=1)) / count
            unbiased += part
            resampled += part * (count - 1) / count
            squares += part**2 / (count - 1)
    if squares == 0:
        return 1.0
    tail = (1 + level) / 2
    needed = stats.t.ppf(tail, unbiased**2 / squares) / stats.norm.ppf(tail)
    return float(np.sqrt(unbiased / resampled) * needed)


def _factors(sides: Sequence[Strata]) -> list[tuple[FloatArray, float]]:
    """What is drawn: means of each side's training seeds, and of the episodes of each stratum; with weights."""
    seeds = [(np.mean([values.mean(axis=1) for values in strata], axis=0), 1.0) for strata in sides]
    means = [[values.mean(axis=0) for values in strata] for strata in sides]
    episodes = means[0] if len(sides) == 1 else [a - b for a, b in zip(*means, strict=True)]
    return [*seeds, *((values, 1 / len(episodes)) for values in episodes)]
