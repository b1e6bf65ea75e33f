"""When a number of ours agrees with a printed one."""

from __future__ import annotations

MATCH_POINTS, NEAR_POINTS = 2.0, 4.0  # of velocity error; chosen


def verdict(difference: float) -> str:
    """`match`, `near` or `miss` for a difference in points of velocity error."""
    distance = abs(difference)
    return "match" if distance <= MATCH_POINTS else "near" if distance <= NEAR_POINTS else "miss"
