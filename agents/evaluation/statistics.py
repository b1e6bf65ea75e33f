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
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray

LEVEL = 0.95
RESAMPLES = 4000
CHUNK = 200_000  # numbers resampled at a time
Strata: TypeAlias = Sequence[FloatArray]
Statistic: TypeAlias = Callable[[Sequence[FloatArray]], FloatArray]  # strata (R, S, E) -> (R,)


@dataclass(frozen=True)
class Estimate:
    """A mean with its interval; without one where there is a single training seed and a single episode."""

    mean: float
    low: float | None
    high: float | None
    seeds: int  # training seeds
    episodes: int  # of each, in all strata

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
    strata = [np.asarray(values, np.float64) for values in strata]
    _check(strata)
    strata = _in_order(strata)
    origin = strata[0][0, 0]  # constant data stay exactly constant
    centred = [values - origin for values in strata]
    found = float(statistic([values[np.newaxis] for values in centred])[0])
    low = high = None
    seeds, episodes = len(strata[0]), sum(values.shape[1] for values in strata)
    if seeds > 1 or any(values.shape[1] > 1 for values in strata):
        drawn = _resampled(centred, statistic, resamples, np.random.default_rng(seed))
        ends = np.quantile(drawn, [(1 - level) / 2, (1 + level) / 2])
        stretched = found + _stretch(centred, level) * (ends - found)
        low, high = (float(end + origin) for end in (min(stretched[0], found), max(stretched[1], found)))
    return Estimate(found + float(origin), low, high, seeds, episodes)


def difference(learned: Strata, baseline: Strata, factor: float = 1.0, **options: Any) -> Estimate:
    """The mean of `learned` - `factor` x `baseline` with its interval, episode by episode on the same seeds.

    A baseline that has training seeds of its own counts with its mean over them. Where one side played more episodes,
    the first ones that both played count; a single episode, of an arena and policies that draw nothing, stands for all.

    Raises:
        ValueError: different strata, see also `estimate`.
    """
    if len(learned) != len(baseline):
        raise ValueError(f"{len(learned)} and {len(baseline)} strata cannot be paired")
    return estimate([_paired(a, b, factor) for a, b in zip(learned, baseline, strict=True)], **options)


def _paired(learned: FloatArray, baseline: FloatArray, factor: float) -> FloatArray:
    other: FloatArray = baseline.mean(axis=0)
    if min(learned.shape[1], len(other)) > 1:
        shared = min(learned.shape[1], len(other))
        learned, other = learned[:, :shared], other[:shared]
    paired: FloatArray = learned - factor * other
    return paired


def _check(strata: Strata) -> None:
    if not strata or any(values.ndim != 2 or not values.size for values in strata):
        raise ValueError("every stratum needs an array (training seeds, episodes) with something in it")
    if len({len(values) for values in strata}) > 1:
        raise ValueError("every stratum needs the same training seeds")
    if not all(np.isfinite(values).all() for values in strata):
        raise ValueError("scores have to be finite")


def _in_order(strata: Strata) -> Strata:
    """The same data, training seeds and episodes sorted by their scores.

    Neither has an order of its own, so the interval must not depend on the one they come in: resamples of a few seeds
    take few values, and an end may jump from one to the next.
    """
    seeds = sorted(range(len(strata[0])), key=lambda s: [np.sort(values[s]).tolist() for values in strata])
    columns = [sorted(values.T.tolist(), key=sorted) for values in (values[seeds] for values in strata)]
    return [np.array(each, np.float64).T for each in columns]


def _resampled(strata: Strata, statistic: Statistic, resamples: int, generator: np.random.Generator) -> FloatArray:
    """The statistic of resampled data (resamples,)."""
    seeds, size = len(strata[0]), sum(values.size for values in strata)
    parts = []
    for first in range(0, resamples, step := max(CHUNK // size, 1)):
        count = min(step, resamples - first)
        rows = generator.integers(seeds, size=(count, seeds, 1))
        drawn = []
        for values in strata:
            episodes = values.shape[1]
            drawn.append(values[rows, generator.integers(episodes, size=(count, 1, episodes))])
        parts.append(statistic(drawn))
    return np.concatenate(parts)


def _stretch(strata: Strata, level: float) -> float:
    """How much longer the interval has to be than that of the percentiles."""
    stats = require("scipy.stats", extra="baselines", purpose="an interval")
    unbiased = resampled = squares = 0.0
    for values, weight in _factors(strata):
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


def _factors(strata: Strata) -> list[tuple[FloatArray, float]]:
    """What is drawn: the training seeds' means over everything, the episodes' means of each stratum; with weights."""
    seeds = np.mean([values.mean(axis=1) for values in strata], axis=0)
    return [(seeds, 1.0), *((values.mean(axis=0), 1 / len(strata)) for values in strata)]
