"""CMA-ES, the one search of this house: every search of numbers is generations of it, judged by a function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray

Judge = Callable[[FloatArray], FloatArray | None]  # what candidates (P, k) reach, (P,); None: the search has to end


class Generation(NamedTuple):
    """The candidates of one generation, with what each has reached."""

    points: FloatArray  # (P, k)
    values: FloatArray  # (P,) to be maximised


class Evolution:
    """One run, whose draws depend on `seed` alone; NumPy's global generator stays untouched.

    Raises:
        MissingExtraError: cma is not installed.
    """

    def __init__(
        self,
        origin: FloatArray,
        spread: float,
        *,
        seed: int | Sequence[int],
        population: int | None = None,
        bounds: FloatArray | None = None,  # lowest and highest point, (2, k); infinite where there is none
    ) -> None:
        cma: Any = require("cma", extra="baselines", purpose="searching numbers")
        generator = np.random.default_rng(seed)
        options: dict[str, Any] = {
            "seed": np.nan,
            "randn": lambda *shape: generator.standard_normal(shape),
            "verbose": -9,
        }
        options |= {} if population is None else {"popsize": population}
        if bounds is not None and np.isfinite(bounds).any():
            options["bounds"] = [[float(end) if np.isfinite(end) else None for end in ends] for ends in bounds]
        self._strategy = cma.CMAEvolutionStrategy(origin, spread, options)

    @property
    def mean(self) -> FloatArray:
        """The middle of the search distribution (k,), which chance moves less than it does the best candidate."""
        strategy = self._strategy
        found: FloatArray = strategy.gp.pheno(strategy.mean, into_bounds=strategy.boundary_handler.repair)
        return found

    @property
    def deviation(self) -> float:
        """The width of the search distribution, in units of the search."""
        return float(self._strategy.sigma)

    @property
    def has_converged(self) -> bool:
        """Whether further generations would find nothing new."""
        return bool(self._strategy.stop())

    def step(self, judge: Judge) -> Generation | None:
        """One generation; None where the judge has ended the search, which leaves everything as it was before."""
        points = self._strategy.ask()
        values = judge(np.array(points))
        if values is None:
            return None
        self._strategy.tell(points, (-values).tolist())
        return Generation(np.array(points), values)
