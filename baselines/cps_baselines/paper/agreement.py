"""When a number of ours agrees with a printed one."""

from __future__ import annotations

from cps_baselines.reproduction.verdicts import ABSOLUTE, Tolerance, of_cell

POINTS = Tolerance(2.0, ABSOLUTE)  # of velocity errors in percent; chosen


def verdict(difference: float) -> str:
    """`match`, `near` (within twice POINTS) or `miss` for a difference in points of velocity error."""
    return of_cell(difference, 0.0, POINTS)
