"""The evolution strategy with covariance adaptation, with draws of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import cma
import numpy as np

from cps_envs.core.types import FloatArray


def evolve(
    evaluate: Callable[[FloatArray, int], FloatArray],
    origin: FloatArray,
    spread: float,
    *,
    population: int,
    generations: int,
    seed: Sequence[int],
) -> Iterator[tuple[float, FloatArray]]:
    """The best candidate (k,) of each generation with its value, which is maximised.

    `evaluate` gives the values (P,) of candidates (P, k) in the generation that it is told.
    """
    strategy = make_strategy(origin, spread, population=population, seed=seed)
    for generation in range(generations):
        candidates = np.array(strategy.ask())
        values = evaluate(candidates, generation)
        strategy.tell(list(candidates), (-values).tolist())
        yield float(values.max()), candidates[int(values.argmax())]


def make_strategy(origin: FloatArray, spread: float, *, population: int, seed: int | Sequence[int]) -> Any:
    """A strategy of `cma`, silent, whose draws depend on `seed` alone; NumPy's global generator stays untouched."""
    generator = np.random.default_rng(seed)
    options = {
        "popsize": population,
        "seed": np.nan,
        "randn": lambda *shape: generator.standard_normal(shape),
        "verbose": -9,
    }
    return cma.CMAEvolutionStrategy(origin, spread, options)
