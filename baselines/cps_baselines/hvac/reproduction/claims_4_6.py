"""The claims of section 4.5.2 about the sets under a negative bias of sensor 2: C29 and C30."""

from __future__ import annotations

from cps_baselines.hvac.reproduction.claims import CLAIMS
from cps_baselines.hvac.reproduction.sets import set_courses
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.evidence import Evidence
from cps_baselines.reproduction.verdicts import of_cases


@CLAIMS.judges("C29")
def flawed_above_intact(evidence: Evidence, claim: Claim) -> Finding:
    """The median residual of every flawed set against the largest of an intact one."""
    courses = set_courses(evidence)
    highest = max(each.residual_c2 for each in courses if each.intact)
    flawed = [each for each in courses if not each.intact]
    hold = [each.residual_c2 > highest for each in flawed]
    below = [each for each, holds in zip(flawed, hold, strict=True) if not holds]
    above = [each.residual_c2 for each, holds in zip(flawed, hold, strict=True) if holds]
    shown = (
        f"intact up to {highest:.2f}; {len(above)} of {len(flawed)} flawed {joined([min(above), max(above)], '.1f')}"
    )
    shown += "".join(
        f"; set {each.index} {each.residual_c2:.3f}, later {each.late_residual_c2:.3f} °C²" for each in below
    )
    return Finding(all(hold), shown, of_cases(hold))


@CLAIMS.judges("C30")
def selected_by_mtd1(evidence: Evidence, claim: Claim) -> Finding:
    """Sets selected, each against the paper's list."""
    courses, paper = set_courses(evidence), {int(number) for number in claim.numbers}
    hold = [each.selected == (each.index in paper) for each in courses]
    ours = [each.index for each in courses if each.selected]
    more = [each for each in courses if each.selected and each.index not in paper]
    shown = ", ".join(map(str, ours))
    shown += "".join(f"; set {each.index} in {100.0 * each.selected_share:.0f} % of the steps" for each in more)
    return Finding(tuple(map(float, ours)), shown, of_cases(hold))
