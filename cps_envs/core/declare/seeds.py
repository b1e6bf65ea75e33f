"""Which seeds are for what, so that nothing is judged on what it was trained on.

Episodes that `play`, `benchmark`, `league` and every report show have the seeds 0, 1, ...; training and the validation
that chooses among checkpoints never see those.

Scores of the challenge have seeds of their own, above 10^9, see `score_seeds`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cps_envs.core.errors import ConfigurationError

EVALUATION = range(0, 1_000_000)
VALIDATION = range(1_000_000, 2_000_000)
TRAINING_START = 2_000_000
SEEDS_PER_RUN = 100_000  # more than any number of environments, times resumptions
SEEDS_PER_BLOCK = 10_000  # of validation
MOST_RUNS = 9_000  # so that training ends below 10^9, from where on scores have their seeds
SPLITS: Mapping[str, range] = {  # seeds of scores
    "dev": range(10**9, 10**9 + 10**8),
    "test": range(10**12, 10**12 + 10**8),
    "fresh": range(10**15, 10**15 + 10**18),  # too many to be known ahead, drawn by a key that nobody knew
}
BLOCK = 10**6  # seeds of an opponent


def training_seed(seed: int, resumption: int = 0) -> int:
    """The seed of the first environment of a training run; a resumed run goes on with seeds of its own.

    Raises:
        ConfigurationError: there is no run of this number.
    """
    if not 0 <= seed < MOST_RUNS:
        raise ConfigurationError(f"seed = {seed} numbers a training run: choose one from 0 to {MOST_RUNS - 1}")
    return TRAINING_START + seed * SEEDS_PER_RUN + resumption * (SEEDS_PER_RUN // 20)


def validation_seed(seed: int) -> int:
    """The first validation seed of a block; blocks are numbered from 0.

    Raises:
        ConfigurationError: there is no block of this number.
    """
    most = len(VALIDATION) // SEEDS_PER_BLOCK
    if not 0 <= seed < most:
        raise ConfigurationError(
            f"seed = {seed} numbers a block of validation episodes: choose one from 0 to {most - 1}"
        )
    return VALIDATION.start + seed * SEEDS_PER_BLOCK


def score_seeds(split: str, place: int, episodes: int) -> range:
    """The seeds of a score against the opponent at a place of its panel."""
    first = SPLITS[split].start + (1 + place) * BLOCK
    return range(first, first + episodes)


def fresh_seeds(key: int, place: int, episodes: int) -> list[int]:
    """The same of split fresh, which follow from a key of 128 bits that was drawn after the policy was handed in."""
    fresh = SPLITS["fresh"]
    drawn: list[int] = np.random.default_rng([key, place]).integers(fresh.start, fresh.stop, episodes).tolist()
    return drawn


def is_judged(seed: int) -> bool:
    """Whether an episode of this seed is for a judgement that is shown: evaluation and scores.

    Training, validation, which chooses among checkpoints, and any other seed are not.
    """
    return seed in EVALUATION or any(seed in seeds for seeds in SPLITS.values())
