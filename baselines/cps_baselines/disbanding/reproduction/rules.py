"""The claims of the chapter, which the functions in `claims_*` check, and the rules of its verdicts."""

from __future__ import annotations

from cps_baselines.disbanding.reproduction.experiments import Evidence
from cps_baselines.reproduction.claims import Claims
from cps_baselines.reproduction.recovery import RECOVERY_RULE

CLAIMS: Claims[Evidence] = Claims("claims_ch2")
RULES = (
    "Rules. A number: reproduced within 5 % of the paper's, near within 10 %. A velocity error: reproduced within 2.0 "
    "points, near within 4.0. A statement about several cases: reproduced if it holds in all, near in all but one, "
    "partly in some. Otherwise not reproduced. "
) + RECOVERY_RULE
