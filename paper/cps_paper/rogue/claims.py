"""The claims of chapter 5; the functions in `claims_*` check them, and `evaluation` calls these."""

from __future__ import annotations

from cps_paper.claims import Claims
from cps_paper.rogue.experiments import RogueEvidence
from cps_paper.verdicts import COMPARISON_RULE, RECOVERY_RULE

CLAIMS: Claims[RogueEvidence] = Claims("claims_ch5")
FAR_LESS = 0.5  # chosen: "far less" and "greatly" mean below this share
RULES = (
    "Rules, the same for both contacts. A statement about several cases (frequencies, ratios, thresholds): reproduced "
    "if it holds in all, near in all but one of three or more, partly in some, otherwise not reproduced. About equal: "
    f"reproduced within 5 %, near within 10 %. Greatly, far: below half. A crash at high "
    f"speed: 5 m/s or more. {COMPARISON_RULE}`pass` is the accounting (5.8) with vehicles "
    "that pass through one another, damage in m; `solid` that of bodies, damage in m/s. "
) + RECOVERY_RULE
