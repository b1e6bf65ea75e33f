"""The rules by which a claim counts as reproduced; no verdict is typed in."""

from __future__ import annotations

from collections.abc import Sequence

from baselines.paper.agreement import verdict

REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN = "reproduced", "near", "partly", "not reproduced", "not evaluated"
VERDICTS = (REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN)
SAME_SHARE, NEAR_SHARE = 0.05, 0.10  # relative differences; chosen

RULES = (
    "Rules. A number: reproduced within 5 % of the paper's, near within 10 %. A velocity error: reproduced within 2.0 "
    "points, near within 4.0. A statement about several cases: reproduced if it holds in all, near in all but one, "
    "partly in some. Otherwise not reproduced."
)


def of_number(ours: float | None, paper: float) -> str:
    """Within a share of the paper's number; None means that the event never happened."""
    difference = float("inf") if ours is None else abs(ours - paper)
    if difference <= SAME_SHARE * abs(paper):
        return REPRODUCED
    return NEAR if difference <= NEAR_SHARE * abs(paper) else NOT


def of_points(ours: float, paper: float) -> str:
    """A velocity error in percent, by the rule of the tables' cells."""
    return {"match": REPRODUCED, "near": NEAR, "miss": NOT}[verdict(ours - paper)]


def of_cases(hold: Sequence[bool]) -> str:
    """A statement that has to hold in every case."""
    if all(hold):
        return REPRODUCED
    if len(hold) > 2 and sum(hold) == len(hold) - 1:
        return NEAR
    return PARTLY if any(hold) else NOT
