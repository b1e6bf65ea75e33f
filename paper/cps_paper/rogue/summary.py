"""The closing words: what of the chapter can be reproduced, how selected the configuration is, and why."""

from __future__ import annotations

from collections.abc import Sequence

from cps_paper.chapter import Reproduction
from cps_paper.rogue.course import RogueCourse
from cps_paper.rogue.experiments import RogueEvidence
from cps_paper.rogue.fit import Maps, Variant, fits
from cps_paper.rogue.headroom import GENERAL_RIDE, HeadRoom, head_rooms
from cps_paper.rogue.heat_map import DISBANDING, MAPS
from cps_paper.verdicts import NO_SUPPORT, Check, failures

LONG = ("seats", "together", "fit", "headroom")  # left out by --quick
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


def closing(found: Reproduction[RogueEvidence]) -> list[str]:
    """Paragraphs on the parts that were computed."""
    seen, parts, mapped = found.evidence, found.parts, has_maps(found)
    paragraphs = found.claims_summary()
    if mapped:
        paragraphs.append(SELECTED)
        if len({seen.map(defender).peak for defender in MAPS.values()}) == 1:
            paragraphs.append(CORNER)
    if "fit" in parts:
        paragraphs.append(_on_variants(list(fits(seen))))
    if mapped:
        paragraphs.append(VERDICT)
    if "headroom" in parts:
        paragraphs.append(_on_head_room(head_rooms(seen), seen[GENERAL_RIDE]))
    paragraphs.append(_on_checks(found.checks))
    return [*paragraphs, *([f"--quick left out: {', '.join(LONG)}."] if seen.quick else [])]


def has_maps(found: Reproduction[RogueEvidence]) -> bool:
    """Whether the maps of Figs. 5.6 to 5.11 were computed."""
    return bool({"maps", "claims", "fit"} & set(found.parts))


def _on_variants(variants: Sequence[tuple[Variant, Maps, list[bool]]]) -> str:
    whole = [variant.name for variant, _, hold in variants if all(hold)]
    broken = [variant.name for variant, _, hold in variants if not all(hold)]
    return f"Of {len(variants)} variants all eight orderings hold in: {'; '.join(whole)}. Not in: {'; '.join(broken)}."


def _on_head_room(found: Sequence[HeadRoom], fooled: RogueCourse) -> str:
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
    largest = max(abs(check.ours / check.reference.value - 1) for check in checks)
    text = (
        f"Regression check against our second implementation: {len(checks) - len(failed)} of {len(checks)} damages "
        f"within their tolerances (maxima of maps 5 %, cells 1 %); largest difference {largest:.2%}. {NO_SUPPORT}"
    )
    return text + failures(f"{check.label}: {check.ours:.4g} for {check.reference.value:g}" for check in failed)
