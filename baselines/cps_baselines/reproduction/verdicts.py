"""The rules by which numbers agree and claims count as reproduced; no verdict is typed in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN = "reproduced", "near", "partly", "not reproduced", "not evaluated"
VERDICTS = (REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN)
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
