"""The regression check: our three E_v against those of our second implementation of the same specification."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

from cps_envs.core.types import FloatArray


@dataclass(frozen=True)
class Reference:
    """What the reference implementation has for a case, over seeds of its own."""

    mean: float  # percent
    deviation: float
    seeds: int

    def allowance(self, num_seeds: int) -> float:
        """How far a mean over so many seeds may lie from the reference's: its deviation, for as many seeds as it has.

        Fewer seeds are allowed more, by the standard error of the difference of both means; more are not allowed less.
        """
        return self.deviation * max(1.0, math.sqrt((1 / num_seeds + 1 / self.seeds) * self.seeds / 2))


@dataclass(frozen=True)
class Check:
    """A case beside its reference."""

    figure: str
    mean: float  # ours, percent
    num_seeds: int
    reference: Reference

    @property
    def difference(self) -> float:
        """Ours minus the reference's, in points."""
        return self.mean - self.reference.mean

    @property
    def passed(self) -> bool:
        """Whether it is within the allowance."""
        return abs(self.difference) <= self.reference.allowance(self.num_seeds)


@lru_cache(maxsize=1)
def references() -> dict[str, Reference]:
    """References by figure."""
    text = files("cps_baselines.testbed").joinpath("reference.csv").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return {
        row["figure"]: Reference(float(row["mean"]), float(row["deviation"]), int(row["seeds"]))
        for row in csv.DictReader(lines)
    }


def check(figure: str, errors: FloatArray) -> Check:
    """The E_v (S,) of a case beside its reference."""
    return Check(figure, float(errors.mean()), len(errors), references()[figure])
