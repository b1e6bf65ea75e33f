"""The rules of the chapter's verdicts: the common ones, and one for velocity errors."""

from __future__ import annotations

from cps_baselines.paper.agreement import verdict
from cps_baselines.reproduction.recovery import RECOVERY_RULE
from cps_baselines.reproduction.verdicts import NEAR, NOT, REPRODUCED

RULES = (
    "Rules. A number: reproduced within 5 % of the paper's, near within 10 %. A velocity error: reproduced within 2.0 "
    "points, near within 4.0. A statement about several cases: reproduced if it holds in all, near in all but one, "
    "partly in some. Otherwise not reproduced. "
) + RECOVERY_RULE


def of_points(ours: float, paper: float) -> str:
    """A velocity error in percent, by the rule of the tables' cells."""
    return {"match": REPRODUCED, "near": NEAR, "miss": NOT}[verdict(ours - paper)]
