"""The closing words: what agrees with the paper, what does not, and why; the numbers in them are computed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from cps_paper.chapter import Reproduction
from cps_paper.claims import Findings
from cps_paper.hvac.cells import TemperatureRow, table_rows
from cps_paper.hvac.controllers import Controller, HvacEvidence
from cps_paper.verdicts import MATCH, MISS, NEAR, NO_SUPPORT, REPRODUCED, UNKNOWN, Check, failures

TABLES = ("4.1", "4.2")
CONSTANTS = (
    "Why: the paper prints none of its constants, neither the building's resistances and capacities nor the weather, "
    "horizon, weights, noise, amplitude and onset of the attacks, or eps. Ours are one calibrated set for everything. "
    "The weight R was chosen so that C12 comes out; its agreement is a fit, not a confirmation."
)
PRINTED = (
    "Not reproducible as printed: (4.4) has 2/C3 for 1/C3, (4.16) lacks R, (4.18) has the wrong sign, (4.30) perturbs "
    "a matrix with eigenvalues near 1 so that the building becomes unstable, (4.33) divides by 0, and Algorithm 4 does "
    "not end when no two sets pass. The specification's corrections are used throughout."
)
LEVELS = (
    "Not reproducible: an input that settles at 1 % of E for E of 1, 0.5 and 0.1 kW (C06 to C08). That would be 10, 5 "
    "and 1 W against the same losses. Nor that zones are heated only below the reference (C04): a controller that "
    "knows the weather to come heats ahead of it."
)
NOISE = (
    "Not reproducible: Table 4.1. With readings the paper's errors grow eightfold from 20 to 80 % of noise variance, "
    "while the standard deviation of the noise doubles, as our errors do. With estimates ours are set by the weather, "
    "which heating alone cannot counter, so noise and the number of sensors hardly matter. Read as standard deviations "
    "(part deviation) the percentages let our errors grow four- to fivefold, but only with an R that contradicts C12."
)
PERTURBED = (
    "Not reproducible: Table 4.2's gain from more sensors (C28). Every set shares the model's error, and more sensors "
    "do not remove it. Single numbers of this table say little: heating does not help a perturbed building that is too "
    "warm, and a median over a dozen buildings may be twice or half that over another dozen."
)
FALLBACK = (
    "Open in the paper, and decisive: what MTD2 does when no set passes (C35, C38). With the set of the least mean "
    "residual it fails when all sensors are attacked, as the paper says; with the model's prediction, which needs no "
    "sensors, no attack from step 200 on can make it fail as long as the model is exact."
)
NO_EDGE = (
    "Not reproducible: the shares at which MTD1 fails with eight sensors (C39 to C41). Its impact grows without an "
    "edge, so the share depends on where the line is drawn, and the random attack is the mildest here but the worst "
    "in the paper."
)
SINGLE = (
    "Not reproducible: that every flawed set has a larger residual than any intact one (C29, C30). A constant reading "
    "is consistent with itself: once the window holds nothing else, the attacked sensor alone fits perfectly."
)
QUICK = (
    "--quick left out, unless asked for: Table 4.2 (C27, C28, C47), eight sensors (Fig. 4.8, C38 to C42), "
    "part deviation and the attacks before step 200."
)
REASONS = (  # words, and the parts and the claims that they are about
    (LEVELS, ("4.3fig",), ("C04", "C06", "C07", "C08")),
    (NOISE, ("4.1",), ("C24", "C25")),
    (PERTURBED, ("4.2",), ("C27", "C28")),
    (SINGLE, ("4.6fig",), ("C29", "C30")),
    (FALLBACK, ("4.7fig", "4.8fig"), ("C35", "C38")),
    (NO_EDGE, ("4.8fig",), ("C39", "C40", "C41")),
    (PRINTED, ("claims",), ()),
)


def closing(found: Reproduction[HvacEvidence]) -> list[str]:
    """Paragraphs on the parts that were computed."""
    seen = found.evidence
    paragraphs = [_on_table(table, table_rows(seen, table)) for table in TABLES if table in found.parts]
    paragraphs += found.claims_summary()
    paragraphs += _reasons(found.parts, found.findings.get("", ()))
    paragraphs += [CONSTANTS, _on_controller(seen.controller), *_on_checks(found.checks)]
    return [*paragraphs, *([QUICK] if seen.quick else [])]


def _on_controller(controller: Controller) -> str:
    config = controller.config
    return (
        f"Controller: {controller.name}, {controller.reading}, with N = {config.prediction_steps} and "
        f"R = {config.move_weight:g}. The paper does not print how (4.17) keeps the heating between 0 and E; "
        "--controller clip, qp or levels computes the chapter with each reading."
    )


def _reasons(parts: Sequence[str], findings: Findings) -> list[str]:
    """What is said about the parts, and about claims that were checked and are not reproduced."""
    failed = {claim.id for claim, finding in findings if finding.verdict not in (REPRODUCED, UNKNOWN)}
    return [words for words, places, claims in REASONS if set(places) & set(parts) or set(claims) & failed]


def _on_table(table: str, rows: Sequence[TemperatureRow]) -> str:
    words = Counter(cell.verdict for row in rows for cell in row.cells)
    count = sum(words.values())
    return f"Table {table}: {words[MATCH]} of {count} cells match, {words[NEAR]} are near, {words[MISS]} are missed."


def _on_checks(checks: Sequence[Check]) -> list[str]:
    if not checks:
        return []
    inside = sum(each.inside for each in checks)
    text = f"Regression check against our second implementation: {inside} of {len(checks)} numbers lie within "
    text += f"their tolerances. {NO_SUPPORT} The parameters were fitted on both together."
    known = [each for each in checks if each.passed and not each.inside]
    if known:
        text += f" Outside, as before: {'; '.join(map(_outside, known))}."
    failed = [each for each in checks if not each.passed]
    text += failures(map(_outside, failed))
    return [text]


def _outside(check: Check) -> str:
    error = check.subject.standard_error
    spread = "" if error is None else f" ± {error:.2g}"
    reason = f" ({check.reference.reason})" if check.passed and check.reference.reason else ""
    value, reference = check.ours, check.reference
    shown = f"{check.label} {value:.4g}{spread}, reference {reference.value:g}"
    return f"{shown} within {reference.tolerance.shown}{reason}"
