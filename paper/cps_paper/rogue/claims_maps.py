"""The claims about Figs. 5.6 to 5.11: R08 to R16, R18 and R20."""

from __future__ import annotations

from cps_paper.claims import Claim, Finding, joined
from cps_paper.rogue.claims import CLAIMS, FAR_LESS
from cps_paper.rogue.experiments import RogueEvidence
from cps_paper.rogue.heat_map import (
    CONTACTS,
    FREQUENCIES_HZ,
    MAPS,
    RATIOS,
    bumper_gap_m,
    collision_frequency_hz,
)
from cps_paper.verdicts import of_number

FALL = 2.0  # the lower half of the frequencies against the upper one


@CLAIMS.judges("R08", "R09")
def falls_with_frequency(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Mean damage in the lower and in the upper half of the frequencies, at each ratio."""
    heat_map = evidence.map(MAPS[claim.figure])
    hold = [bool(low > FALL * high) for low, high in zip(heat_map.low, heat_map.high, strict=True)]
    means = f"{heat_map.low.mean():.1f} in the lower, {heat_map.high.mean():.1f} in the upper half of f"
    return Finding.of_cases(hold, f"{means}; so at {sum(hold)} of {len(hold)} ratios")


@CLAIMS.judges("R10", "R11")
def detection_lowers_the_maximum(evidence: RogueEvidence, claim: Claim) -> Finding:
    """The maximum with detection against that without."""
    other = evidence.map("pd" if claim.id == "R10" else "sliding")
    heat_map = evidence.map("sliding_detection")
    means = f"means {heat_map.mean:.1f} against {other.mean:.1f}"
    shown = f"maximum {_against(heat_map.highest, other.highest, evidence)}; {means}"
    return Finding.of_comparisons([other.highest], [heat_map.highest], shown)


@CLAIMS.judges("R12")
def still_high_somewhere(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Whether the maximum with detection is comparable to that without, and not simply at the lowest frequency."""
    heat_map, other = evidence.map("sliding_detection"), evidence.map("sliding")
    frequency_hz, ratio = heat_map.peak
    hold = [heat_map.highest > FAR_LESS * other.highest, frequency_hz > heat_map.frequencies_hz[0]]
    edge = "" if hold[1] else ", the lowest frequency of the map"
    unit = CONTACTS[evidence.contact]
    shown = f"maximum {heat_map.highest:.1f} {unit} at {frequency_hz:g} Hz and ratio {ratio:g}{edge}"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("R13", "R14")
def disbanding_raises_the_maximum(evidence: RogueEvidence, claim: Claim) -> Finding:
    """The maximum with early disbanding against that with detection alone."""
    ours, alone = evidence.map(MAPS[claim.figure]).highest, evidence.map("sliding_detection").highest
    return Finding.of_comparisons([ours], [alone], f"maximum {_against(ours, alone, evidence)}")


@CLAIMS.judges("R15")
def late_disbanding_is_better(evidence: RogueEvidence, claim: Claim) -> Finding:
    """The maximum with +7 m against those with +2 m and +4 m."""
    late = evidence.map("disband_7").highest
    early = [evidence.map(defender).highest for defender in ("disband_2", "disband_4")]
    shown = "; ".join(_against(late, each, evidence) for each in early)
    return Finding.of_comparisons(early, [late] * len(early), f"maximum {shown}")


@CLAIMS.judges("R16")
def late_disbanding_equals_detection(evidence: RogueEvidence, claim: Claim) -> Finding:
    """The maximum with +7 m against that with detection alone."""
    late, alone = evidence.map("disband_7").highest, evidence.map("sliding_detection").highest
    verdict = of_number(late, alone)
    return Finding(late / alone, f"maximum {_against(late, alone, evidence)}", verdict)


@CLAIMS.judges("R18")
def collision_line(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Up to which frequency the sliding mode collides, against the line for the gap between bumpers."""
    last = evidence.map("sliding").last_harmful_hz
    line = [collision_frequency_hz(ratio, bumper_gap_m()) for ratio in RATIOS]
    half_cell_hz = (FREQUENCIES_HZ[1] - FREQUENCIES_HZ[0]) / 2
    hold = [ours <= limit + half_cell_hz for ours, limit in zip(last, line, strict=True)]
    shown = (
        f"sliding mode collides up to {joined(last, '.2f')} Hz, the line is at {joined(line, '.2f')} Hz for ratios "
        f"{joined(RATIOS, 'g')} (cells of {2 * half_cell_hz:g} Hz)"
    )
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("R20")
def detection_against_bidirectional(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Mean damage over the frequencies with detection and with the bidirectional law, at each ratio."""
    ours, theirs = evidence.map("sliding_detection"), evidence.map("pd")
    means = [each.damage.mean(axis=1).tolist() for each in (ours, theirs)]
    hold = [a < FAR_LESS * b for a, b in zip(*means, strict=True)]
    shown = (
        f"means {joined(means[0], '.1f')} against {joined(means[1], '.1f')} at ratios {joined(RATIOS, 'g')}; of the "
        f"whole map {_against(ours.mean, theirs.mean, evidence)}"
    )
    return Finding.of_cases(hold, shown)


def _against(ours: float, other: float, evidence: RogueEvidence) -> str:
    """One damage against another, with the difference in percent."""
    form = ".0f" if min(ours, other) >= 100 else ".1f"
    return f"{ours:{form}} against {other:{form}} {CONTACTS[evidence.contact]} ({ours / other - 1:+.0%})"
