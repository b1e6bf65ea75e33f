"""Generations of CMA-ES, as many as are asked for: what the searches of tools have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from cps_baselines.evolution import Evolution
from cps_envs.core.types import FloatArray


def evolve(
    evaluate: Callable[[FloatArray, int], FloatArray],
    origin: FloatArray,
    spread: float,
    *,
    population: int,
    generations: int,
    seed: int | Sequence[int],
) -> Iterator[tuple[float, FloatArray]]:
    """The best candidate (k,) of each generation with its value, which is maximised.

    `evaluate` gives the values (P,) of candidates (P, k) in the generation that it is told.
    """
    run = Evolution(origin, spread, population=population, seed=seed)
    for number in range(generations):
        found = run.step(lambda points, number=number: evaluate(points, number))  # type: ignore[misc]
        assert found is not None
        best = int(found.values.argmax())
        yield float(found.values[best]), found.points[best]
