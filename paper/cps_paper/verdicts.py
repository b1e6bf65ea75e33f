"""The rules by which numbers agree and claims count as reproduced; no verdict is typed in.

The regression check compares our numbers with those of our second implementation of the same specification.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise
from typing import Any

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray

REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN = "reproduced", "near", "partly", "not reproduced", "not evaluated"
GIVEN = "by construction"  # what the paper prints was put in, or something was chosen so that it comes out
OPEN = "open"  # a search ended before it could tell: it counts neither way
VERDICTS = (REPRODUCED, NEAR, PARTLY, NOT, GIVEN, OPEN, UNKNOWN)
MATCH, MISS = "match", "miss"  # words of table cells for REPRODUCED and NOT
SAME_SHARE, NEAR_SHARE = 0.05, 0.10  # relative differences; chosen
ABSOLUTE, SHARE, FACTOR, BELOW = "absolute", "share", "factor", "below"  # kinds of tolerances


@dataclass(frozen=True)
class Tolerance:
    """How far a number may be from another one."""

    amount: float
    kind: str = SHARE  # of the other number; ABSOLUTE; FACTOR by which they may differ; BELOW: above it is all right

    def admits(self, ours: float, other: float, times: float = 1.0) -> bool:
        """Whether a number of ours lies within so many times this tolerance of another one."""
        if self.kind == FACTOR:
            return other / self.amount <= ours <= other * self.amount
        if self.kind == BELOW:
            return ours >= other - times * self.amount
        return abs(ours - other) <= times * self.amount * (abs(other) if self.kind == SHARE else 1.0)

    @property
    def shown(self) -> str:
        """With its unit."""
        if self.kind == FACTOR:
            return f"factor {self.amount:g}"
        return f"{100.0 * self.amount:g} %" if self.kind == SHARE else f"{self.amount:g}"


HOUSE = Tolerance(SAME_SHARE)


def of_number(ours: float | None, paper: float, *tolerances: Tolerance) -> str:
    """Within a tolerance (5 % if none is given) of the paper's number, near within twice that; None: it never came."""
    for times, word in ((1.0, REPRODUCED), (2.0, NEAR)):
        if ours is not None and any(each.admits(ours, paper, times) for each in tolerances or (HOUSE,)):
            return word
    return NOT


def by_construction(verdict: str) -> str:
    """The verdict on a number that was put in, or that something was chosen for: agreement supports nothing."""
    return GIVEN if verdict == REPRODUCED else verdict


def above(larger: float, smaller: float) -> bool:
    """Whether a comparison of two positive numbers holds clearly: by more than SAME_SHARE of the smaller one."""
    return larger > (1.0 + SAME_SHARE) * smaller


def grows_throughout(curve: Sequence[float]) -> bool:
    """Whether a curve rises at every step, and clearly from its first to its last point."""
    return above(curve[-1], curve[0]) and all(earlier < later for earlier, later in pairwise(curve))


COMPARISON_RULE = (
    f"More, less, higher, lower, longer: by more than {100 * SAME_SHARE:g} %; a curve of many points, from its first "
    "to its last. The right sign in all cases, or in all but one of three or more, with less than that: partly. By "
    "construction: the number was put in, or something was chosen so that it comes out. "
)


def of_cell(ours: float, paper: float, *tolerances: Tolerance) -> str:
    """The same for a cell of a table, in the words for cells: MATCH, NEAR or MISS."""
    return {REPRODUCED: MATCH, NEAR: NEAR, NOT: MISS}[of_number(ours, paper, *tolerances)]


def of_cases(hold: Sequence[bool]) -> str:
    """A statement that has to hold in every case."""
    if all(hold):
        return REPRODUCED
    if len(hold) > 2 and sum(hold) == len(hold) - 1:
        return NEAR
    return PARTLY if any(hold) else NOT


def of_comparisons(larger: Sequence[float], smaller: Sequence[float]) -> str:
    """Pairs of which the first is to be clearly larger; the right sign without the size is PARTLY."""
    pairs = list(zip(larger, smaller, strict=True))
    verdict = of_cases([above(*pair) for pair in pairs])
    signs = of_cases([one > other for one, other in pairs])
    return PARTLY if verdict == NOT and signs in (REPRODUCED, NEAR) else verdict


RECOVERY_RULE = (
    f"Recovery, by the same rule in every chapter: each speed and each distance is, within {100 * SAME_SHARE:g} % of "
    "the desired one, what it is in the same run without the attack (same seed), from some time on to the end of the "
    "experiment that the paper describes; the time to recovery is that time. Where it is not, partly if it is within "
    f"{100 * NEAR_SHARE:g} %."
)


def deviation(values: FloatArray, calm: FloatArray, desired: FloatArray | float) -> FloatArray:
    """The largest difference over the last axis from the run without attack, as a share of what is desired.

    (..., T, M) with `calm` and `desired` that broadcast to it gives (..., T).
    """
    largest: FloatArray = np.max(np.abs((values - calm) / desired), axis=-1)
    return largest


def recovery_s(time_s: FloatArray, deviations: FloatArray, share: float = SAME_SHARE) -> float | None:
    """The time from which on all deviations (T,) are within a share to the end; None where the last one is not."""
    outside: BoolArray = deviations > share
    if outside[-1]:
        return None
    held = np.flatnonzero(outside)
    return float(time_s[held[-1] + 1]) if len(held) else float(time_s[0])


def of_recovery(same: Sequence[bool], near: Sequence[bool]) -> str:
    """A statement that all of some cases recover, which do so within SAME_SHARE, and within NEAR_SHARE."""
    verdict = of_cases(same)
    return PARTLY if verdict == NOT and any(near) else verdict


def of_recovery_time(same: float | None, near: float | None, paper: float) -> str:
    """The time to recovery within SAME_SHARE, and within NEAR_SHARE, against the paper's; None: never."""
    verdict = of_number(same, paper)
    return PARTLY if verdict == NOT and of_number(near, paper) != NOT else verdict


NO_SUPPORT = (
    "Both programs are ours and share a specification and its parameters: agreement shows that the simulation is the "
    "same, and supports nothing that the paper says."
)
NO_FINDING = "The simulation has changed; this is no finding about the paper."


@dataclass(frozen=True)
class Reference:
    """What the second implementation has, and how near our number has to come."""

    value: float
    tolerance: Tolerance
    recorded: float | None = None  # ours, where it was outside when the file was made
    reason: str = ""  # why


@dataclass(frozen=True)
class Check:
    """A number of ours beside its reference."""

    label: str
    ours: float
    reference: Reference
    subject: Any = None  # whose number it is

    @property
    def difference(self) -> float:
        """Ours minus the reference's."""
        return self.ours - self.reference.value

    @property
    def inside(self) -> bool:
        """Whether ours lies within the tolerance of the reference."""
        return self.reference.tolerance.admits(self.ours, self.reference.value)

    @property
    def passed(self) -> bool:
        """Whether it is inside, or where it was recorded as being outside, still what it was."""
        recorded = self.reference.recorded
        return self.inside or (recorded is not None and self.reference.tolerance.admits(self.ours, recorded))


def failures(lines: Iterable[str]) -> str:
    """A sentence on the checks that failed; empty without any."""
    named = "; ".join(lines)
    return f" FAILED: {named}. {NO_FINDING}" if named else ""


def shipped_rows(package: str, name: str = "reference") -> list[dict[str, str]]:
    """The rows of `<name>.csv` in a package; lines that start with # explain them."""
    text = files(package).joinpath(f"{name}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
