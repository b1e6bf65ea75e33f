"""A simulated measurement whose truth is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from cps_agents.arena.statistics import Estimate


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
