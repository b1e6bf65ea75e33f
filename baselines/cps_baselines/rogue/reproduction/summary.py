"""The closing words: what of the chapter can be reproduced, how selected the configuration is, and why."""

from __future__ import annotations

from collections.abc import Sequence

from cps_baselines.reproduction.findings import findings_summary
from cps_baselines.reproduction.regression import NO_SUPPORT
from cps_baselines.rogue.reproduction.course import Course
from cps_baselines.rogue.reproduction.evaluation import FindingsByContact
from cps_baselines.rogue.reproduction.fit import Maps, Variant
from cps_baselines.rogue.reproduction.headroom import HeadRoom
from cps_baselines.rogue.reproduction.parts import LONG
from cps_baselines.rogue.reproduction.reference import Check
from cps_baselines.rogue.reproduction.settings import DISBANDING

SELECTED = (
    "How selected this configuration is. The text leaves out the detector's form, the strongest braking effort F-, the "
    "axes of the maps, their duration, n_1 to n_3, the interval of the growth, the human model and what counts as "
    "contact. They were chosen so that the orderings of the maps come out, and combinations for which they do are "
    "rare. An independent study, which this command does not repeat, judged 818 combinations on four windows of the "
    "axes by eight orderings (part fit): all eight hold in 27 of 1152 cells with contact pass, in 12 of 640 where each "
    "contact counts once, in 0 of 816 where a pair counts while abs(dx) < l, and in 0 of 640 with solid bodies. The "
    "text says no more than that c is 1 if there is a collision (5.8). All hits have a detector on the residual of "
    "acceleration with threshold l_1 = 200; all hits with pass disband everyone at once."
)
CORNER = (
    "All maxima with contact pass lie in one corner cell, the lowest frequency at the highest ratio: each ordering of "
    "maxima is an ordering of one cell."
)
VERDICT = (
    "Verdict: the paper's orderings can be produced by a selected configuration; they are not a robust property of "
    "the model. Nothing is tuned per claim."
)


def closing(
    findings: FindingsByContact,
    variants: Sequence[tuple[Variant, Maps, list[bool]]],
    head_rooms: Sequence[HeadRoom],
    fooled: Course | None,
    peaks: set[tuple[float, float]],
    checks: Sequence[Check],
    *,
    quick: bool,
) -> list[str]:
    """Paragraphs on the parts that were computed; `peaks` are where the maps with contact pass have their maxima.

    `fooled` is the course behind `head_rooms` against detection; None without them.
    """
    paragraphs = [f"Contact {contact}. {findings_summary(found)}" for contact, found in findings.items()]
    if findings or peaks:
        paragraphs.append(SELECTED)
    if len(peaks) == 1:
        paragraphs.append(CORNER)
    if variants:
        paragraphs.append(_on_variants(variants))
    if findings or peaks:
        paragraphs.append(VERDICT)
    if fooled is not None:
        paragraphs.append(_on_head_room(head_rooms, fooled))
    paragraphs.append(_on_checks(checks))
    return [*paragraphs, *([f"--quick left out: {', '.join(LONG)}."] if quick else [])]


def _on_variants(variants: Sequence[tuple[Variant, Maps, list[bool]]]) -> str:
    whole = [variant.name for variant, _, hold in variants if all(hold)]
    broken = [variant.name for variant, _, hold in variants if not all(hold)]
    return f"Of {len(variants)} variants all eight orderings hold in: {'; '.join(whole)}. Not in: {'; '.join(broken)}."


def _on_head_room(found: Sequence[HeadRoom], fooled: Course) -> str:
    """`fooled` is the course of the general attacker against detection at equal power."""
    equal = {each.defender: each for each in found if each.power_ratio == 1.0}
    detection = equal["sliding_detection"]
    text = (
        f"Against detection at equal power searched attackers do {max(detection.verified, detection.general):.0f} m/s, "
        f"an independent search did {detection.other['verified']:.1f}, and the best square wave {detection.square:.1f}."
    )
    ahead = fooled.attacker + 1
    if fooled.alarm[-1, ahead] > 0:
        text += (
            f" It makes vehicle {ahead + 1} blame the one ahead of it, which vehicle {ahead + 1} then follows "
            "for good, without watching the attacker behind it."
        )
    handed = [max(equal[name].verified, equal[name].general) for name in DISBANDING]
    stronger = [each for each in found if each.power_ratio > 1.0]
    least = min(max(each.square, each.duty, each.verified, each.general) for each in stronger)
    return (
        f"{text} Disbanding allows {min(handed):.0f} to {max(handed):.0f} m/s, as humans do not watch the rear. At "
        f"ratio {stronger[0].power_ratio:g} none of the paper's controllers keeps below {least:.0f} m/s."
    )


def _on_checks(checks: Sequence[Check]) -> str:
    failed = [check for check in checks if not check.passed]
    largest = max(abs(check.difference) for check in checks)
    text = (
        f"Regression check against our second implementation: {len(checks) - len(failed)} of {len(checks)} damages "
        f"within their tolerances (maxima of maps 5 %, cells 1 %); largest difference {largest:.2%}. {NO_SUPPORT}"
    )
    if failed:
        lines = (f"{check.reference.label}: {check.ours:.4g} for {check.reference.damage:g}" for check in failed)
        text += f" FAILED: {'; '.join(lines)}. The simulation has changed; this is no finding about the paper."
    return text
