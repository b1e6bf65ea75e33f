"""The rules by which a claim counts as reproduced; no verdict is typed in."""

from __future__ import annotations

from collections.abc import Sequence

REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN = "reproduced", "near", "partly", "not reproduced", "not evaluated"
VERDICTS = (REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN)
SAME_SHARE, NEAR_SHARE = 0.05, 0.10  # relative differences; chosen


def of_number(ours: float | None, paper: float) -> str:
    """Within a share of the paper's number; None means that the event never happened."""
    difference = float("inf") if ours is None else abs(ours - paper)
    if difference <= SAME_SHARE * abs(paper):
        return REPRODUCED
    return NEAR if difference <= NEAR_SHARE * abs(paper) else NOT


def of_cases(hold: Sequence[bool]) -> str:
    """A statement that has to hold in every case."""
    if all(hold):
        return REPRODUCED
    if len(hold) > 2 and sum(hold) == len(hold) - 1:
        return NEAR
    return PARTLY if any(hold) else NOT
