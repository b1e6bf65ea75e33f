"""Where in the series of a configuration episodes begin, and which of those places are kept for judgements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cps_envs.core.declare.seeds import is_judged
from cps_envs.core.declare.series import EVEN, Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import BoolArray, Generators, IntArray

SPLITS = ("seed", "all", "train", "test")  # which places an episode may have
LEARNED, JUDGED = 0, 1  # halves of the time


class Places(NamedTuple):
    """The first samples that episodes may have in the grid of steps from `begin_s` on."""

    first: IntArray  # (2, m) of the half for learning and of the half for judging
    counts: IntArray  # (2,) how many of them
    begin_s: float
    steps: int  # of the grid; those of an episode where nothing is a series that ends


def place_episodes(
    series: Sequence[Series], *, step_s: float, steps: int, every_s: float, split: str, block_s: float
) -> Places:
    """The places at which an episode of `steps` samples, those that are seen ahead too, fits into series that end.

    They lie at multiples of `every_s`, at least a step. The time that all series share is cut into blocks of `block_s`,
    from the first such multiple on: the even ones are for learning, the odd ones for judgements, and no episode reaches
    out of its block. "seed" takes the half by an episode's seed (`seeds.is_judged`), "train" and "test" always the same
    half, "all" any place, over the ends of blocks too. Without a series that ends there is one place, at 0 s.

    Raises:
        ConfigurationError: the series are too short for an episode, or for one in each half.
    """
    ending = [each for each in series if not each.repeats]
    if not ending:
        return Places(np.zeros((2, 1), np.int64), np.ones(2, np.int64), 0.0, steps)
    begin_s, end_s = max(each.begin_s for each in ending), min(each.end_s for each in ending)
    begin_s = every_s * np.ceil(begin_s / every_s - EVEN) + 0.0  # not -0
    length = int(np.floor((end_s - begin_s) / step_s + EVEN)) + 1
    wanted_s = (steps - 1) * step_s
    names = ", ".join(sorted({each.source for each in ending if each.source})) or "the series"
    if length < steps:
        raise ConfigurationError(
            f"{names}: there are {_time(max(end_s - begin_s, 0.0))} from {_time(begin_s)} on, where an episode may "
            f"begin, but it needs {_time(wanted_s)} with what is seen ahead; give a longer series or a shorter episode."
        )
    begins_s = np.arange(0.0, (length - steps + EVEN) * step_s, max(every_s, step_s))
    inside = np.floor(begins_s / block_s + 1e-9) == np.floor((begins_s + wanted_s) / block_s - 1e-9)
    half = np.floor(begins_s / block_s + 1e-9).astype(np.int64) % 2
    first = np.round(begins_s / step_s).astype(np.int64)
    halves = [first[inside & (half == mine)] for mine in (LEARNED, JUDGED)]
    if split == "all":
        halves = [first, first]
    elif split != "seed":
        halves = [halves[JUDGED if split == "test" else LEARNED]] * 2
    counts = np.array([len(each) for each in halves])
    if not counts.all():
        raise ConfigurationError(
            f"{names}: no episode of {_time(wanted_s)}, with what is seen ahead, fits into a half of the "
            f"{_time(end_s - begin_s)} in blocks of {_time(block_s)} ({_counted(halves)}); change series_block_s, give "
            'a longer series, or say series_split="all".'
        )
    table = np.zeros((2, counts.max()), np.int64)
    for row, each in zip(table, halves, strict=True):
        row[: len(each)] = each
    return Places(table, counts, float(begin_s), length)


def halves_of(generators: Generators, envs: BoolArray) -> IntArray:
    """The half of the time (B,) for each marked environment, by the seed of its generator.

    Kernels draw a place of it: `first[half, whole(stream, 0, counts[half])]` draws nothing where there is one only.
    """
    from cps_envs.core.compute.generators import seed_of  # brings the compiler of kernels along

    halves = np.zeros(len(envs), np.int64)
    for b in np.flatnonzero(envs).tolist():
        halves[b] = JUDGED if is_judged(seed_of(generators, b)) else LEARNED
    return halves


def _counted(halves: Sequence[IntArray]) -> str:
    return f"{len(halves[LEARNED])} places for learning, {len(halves[JUDGED])} for judgements"


def _time(seconds: float) -> str:
    return f"{seconds / 3600:.4g} h" if seconds >= 3600 else f"{seconds:g} s"
