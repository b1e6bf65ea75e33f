"""Section 2.5 as data: its figure, its claims, the regression check, and what is not reproduced."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from cps_envs.core.errors import ConfigurationError, near
from cps_paper.chapter import CLAIMS as ALL_CLAIMS
from cps_paper.chapter import Chapter, Judged, Reproduction
from cps_paper.testbed.cases import (
    BASE,
    CASES,
    DAMPING,
    LONG_S,
    MITIGATED_CASES,
    ORDERED_SHARE,
    QUICK_SEEDS,
    SEEDS,
    Results,
    needed,
)
from cps_paper.testbed.claims import CLAIMS, RULES
from cps_paper.testbed.exhibits import FIGURE_2_5, spreads
from cps_paper.verdicts import (
    ABSOLUTE,
    NEAR_SHARE,
    NO_SUPPORT,
    SAME_SHARE,
    Check,
    Reference,
    Tolerance,
)

STAND_IN = (
    "This is a simulated stand-in for the robots: of the experiment the paper prints t_s and three values of E_v, and "
    "nearly every other number here is chosen. The size of the gain hangs on them: --damping k1 "
    "has another k_d and another window of E_v. It can say whether a mitigation works on such a plant, and it cannot "
    "confirm the hardware. The paper's gains of 27 and 34 % come from one run of each case."
)
ORDER = "in order"  # the check that E_v falls from case to case


def results(*, quick: bool = False, seeds: int | None = None, damping: str = "k3") -> Results:
    """For the seeds 0, 1, ...; fewer with `quick` where their number is left out.

    Raises:
        ConfigurationError: there is no such reading of the damping.
    """
    if damping not in DAMPING:
        raise ConfigurationError(f"the test bed has no damping {damping!r}. {near(damping, DAMPING)}")
    return Results(quick=quick, num_seeds=seeds or (QUICK_SEEDS if quick else SEEDS), damping=damping)


def reading(evidence: Results) -> str:
    """What it is called where readings stand side by side."""
    until = "to 50 s" if evidence.damping == "k3" else "to the end"
    return f"k_d = {evidence.damping[1:]} /s, E_v {until}"


def checks(found: Reproduction[Results]) -> list[Check]:
    """The three E_v within the reference's spread, and in its order in enough seeds; of the shipped reading only."""
    seen, made = found.evidence, []
    if seen.damping != "k3":
        return []
    for case in CASES:
        spread, errors = spreads()[case.figure], seen.errors(case)
        reference = Reference(spread.mean, Tolerance(spread.allowance(len(errors)), ABSOLUTE))
        made.append(Check(case.figure, float(errors.mean()), reference, spread))
    order = Reference(1.0, Tolerance(1.0 - ORDERED_SHARE, ABSOLUTE))
    return [*made, Check(ORDER, float(seen.ordered.mean()), order)]


def closing(found: Reproduction[Results]) -> list[str]:
    """Paragraphs that say what is not reproduced, and why."""
    words = [*found.claims_summary(), STAND_IN, _on_recovery(found.evidence), _on_checks(found)]
    return [*words, f"--quick left out the runs of {LONG_S:g} s."] if found.evidence.quick else words


def _on_recovery(seen: Results) -> str:
    """Why speeds do not come back, and that they say nothing about the mitigation."""
    mitigated = [seen.recovery(case) for case in MITIGATED_CASES]
    ahead, intact = np.mean([each.shares for each in mitigated], axis=0)
    follows = np.concatenate([each.follows() for each in mitigated])
    with_it = np.concatenate([each.recovered(NEAR_SHARE) for each in mitigated])
    without = seen.recovery(BASE).recovered(NEAR_SHARE)
    return (
        "Why speed does not recover (T13): a human driver at a finite gap stays below v_d by (2.5). At the end the "
        f"robot ahead of the intact ones, which a driver steers since the attack, has {ahead:.0%} of its speed "
        f"without the attack, and the intact ones have {intact:.0%}. Relative to the robot ahead they are as fast "
        f"as without the attack, within {SAME_SHARE:.0%}, in {follows.sum()} of {len(follows)} runs. Recovery does "
        f"not speak for the mitigation: speeds and gaps are within {NEAR_SHARE:.0%} in {with_it.sum()} of "
        f"{len(with_it)} runs with it and in {without.sum()} of {len(without)} without."
    )


def _on_checks(found: Reproduction[Results]) -> str:
    if not found.checks:
        return "No regression check: our second implementation has the other damping."
    parts = (
        f"{each.label} {each.difference:+.2f} of {each.reference.tolerance.amount:.2f} points allowed"
        for each in found.checks
        if each.label != ORDER
    )
    ordered, seeds = int(found.evidence.ordered.sum()), found.evidence.num_seeds
    text = f"Regression check against our second implementation: {'; '.join(parts)}."
    text += f" In order in {ordered} of {seeds} seeds. {NO_SUPPORT}"
    return text if found.passed else f"{text} FAILED: the simulation has changed."


def document(found: Reproduction[Results]) -> dict[str, Any]:
    """Plain data for JSON."""
    data = found.data()
    return {
        "section": "2.5",
        "quick": found.evidence.quick,
        "seeds": found.evidence.num_seeds,
        "cases": data[FIGURE_2_5.name],
        "in_order": found.evidence.ordered,
        "claims": data[ALL_CLAIMS],
        "regression": [_check(found.evidence, each) for each in found.checks if each.label != ORDER],
        "passed": found.passed,
        "closing": found.closing(),
    }


def _check(seen: Results, check: Check) -> dict[str, Any]:
    return {
        "figure": check.label,
        "mean": check.ours,
        "num_seeds": seen.num_seeds,
        "reference": asdict(check.subject),
        "difference": check.difference,
        "passed": check.passed,
    }


JUDGED: Judged[Results] = Judged(CLAIMS, RULES, needed)
CHAPTER: Chapter[Results] = Chapter(
    title="test bed",
    evidence=results,
    reading=reading,
    exhibits=(FIGURE_2_5, JUDGED.exhibit),
    closing=closing,
    document=document,
    checks=checks,
    judged=JUDGED,
)
