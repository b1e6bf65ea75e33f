"""The reproduction as tables of text, ready for a terminal or a page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from baselines.reproduction.block import Block
from baselines.rogue.reproduction.claims import RULES
from baselines.rogue.reproduction.collision_line import bumper_gap_m, collision_frequency_hz
from baselines.rogue.reproduction.evaluation import FindingsByContact
from baselines.rogue.reproduction.evidence import Evidence
from baselines.rogue.reproduction.fit import ORDERINGS, Maps, Variant
from baselines.rogue.reproduction.headroom import DUTIES, DUTY_HZ, HeadRoom
from baselines.rogue.reproduction.settings import (
    CONTACTS,
    COURSE_FREQUENCIES_HZ,
    FREQUENCIES_HZ,
    MAPS,
    RATIOS,
    STEADY_HZ,
    TITLES,
)
from cps_envs.rogue.config import PAPER

DASH = "-"


def courses_block(evidence: Evidence, number: str, defenders: Sequence[str]) -> Block:
    """Figs. 5.3 and 5.5 in numbers."""
    columns = ("", "f, Hz", "D at 25 s", "D at 100 s", "alarm, s", "disbanded, s", "leader behind, m", "slowest, m/s")
    rows = []
    for defender in defenders:
        for frequency_hz in COURSE_FREQUENCIES_HZ:
            course = evidence.course(defender, frequency_hz)
            alarms = course.time_s[(course.alarm != 0).any(axis=1)]
            rows.append(
                (
                    TITLES[defender],
                    f"{frequency_hz:g}",
                    f"{course.damage[course.at(25.0)]:.1f}",
                    f"{course.final_damage:.1f}",
                    f"{alarms[0]:.1f}" if len(alarms) else DASH,
                    DASH if course.disbanded_s is None else f"{course.disbanded_s:.1f}",
                    f"{course.behind_m[-1, -1]:.0f}",
                    f"{course.speed_mps[-1, course.intact].min():.1f}",
                )
            )
    notes = ("The paper shows curves without naming their frequency. Attacker of equal power, contact pass, D in m.",)
    breaks = [k for k in range(len(rows) - 1) if rows[k][0] != rows[k + 1][0]]
    return Block(f"Fig. {number}: damage at equal power", columns, rows, 1, notes, breaks)


def maps_block(evidence: Evidence) -> Block:
    """Figs. 5.6 to 5.11 in numbers, for both contacts."""
    columns = ("Fig.", "", "pass: maximum", "mean, m", "at", "solid: maximum", "mean, m/s", "at")
    rows = []
    for number, defender in MAPS.items():
        cells = [number, TITLES[defender]]
        for contact in CONTACTS:
            heat_map = evidence.under(contact).map(defender)
            frequency_hz, ratio = heat_map.peak
            cells += [f"{heat_map.highest:.1f}", f"{heat_map.mean:.1f}", f"{frequency_hz:g} Hz, {ratio:g}"]
        rows.append(tuple(cells))
    axes = (
        f"{len(FREQUENCIES_HZ)} frequencies from {FREQUENCIES_HZ[0]:g} to {FREQUENCIES_HZ[-1]:g} Hz and power ratios "
        f"{', '.join(f'{ratio:g}' for ratio in RATIOS)}, both chosen; {PAPER.duration_s:g} s, chosen."
    )
    notes = ("The paper prints colours without a scale and no number, so what it says is checked claim by claim.", axes)
    return Block("Figs. 5.6 to 5.11: total damage", columns, rows, 2, notes)


def line_block() -> Block:
    """The collision line for both readings of the gap."""
    gaps = ((bumper_gap_m(), "bumpers, drawn solid"), (PAPER.separation_m, "centres, as printed, drawn dashed"))
    rows = [
        (f"{gap_m:g} m, {name}", *(f"{collision_frequency_hz(ratio, gap_m):.3f}" for ratio in RATIOS))
        for gap_m, name in gaps
    ]
    columns = ("gap", *(f"ratio {ratio:g}" for ratio in RATIOS))
    return Block("Collision line, Hz", columns, rows)


def claims_block(findings: FindingsByContact) -> Block:
    """Every claim with a row per contact."""
    first = next(iter(findings))
    rows = []
    for k, (claim, _) in enumerate(findings[first]):
        for contact, found in findings.items():
            named = (claim.id, claim.figure, claim.text, claim.paper_shown) if contact == first else ("",) * 4
            rows.append((*named, f"{contact}: {found[k][1].shown}", found[k][1].verdict))
    breaks = range(len(findings) - 1, len(rows) - 1, len(findings))
    columns = ("", "Where", "Claim", "Paper", "Ours", "Verdict")
    return Block("What the text claims", columns, rows, 6, (RULES,), list(breaks))


def fit_block(found: Iterable[tuple[Variant, Maps, list[bool]]]) -> Block:
    """Which orderings of the maps survive."""
    columns = ("", *(str(k + 1) for k in range(len(ORDERINGS))), "hold", "maxima: pd, sliding, detection, +2, +4, +7")
    rows = []
    for variant, maps, hold in found:
        maxima = ", ".join(f"{each.highest:.0f}" for each in maps.values())
        rows.append((variant.name, *("yes" if each else "NO" for each in hold), f"{sum(hold)} of {len(hold)}", maxima))
    notes = tuple(f"{k + 1}: {text}." for k, text in enumerate(ORDERINGS))
    return Block("How selected the configuration is: what the paper says of the maps", columns, rows, 1, notes)


def head_room_block(found: Sequence[HeadRoom]) -> Block:
    """Kinds of attackers in the setting of the learning problem."""
    columns = ("ratio", "", "throttle", "square", "duty", "at", "searched", "verified", "general")
    rows = []
    for each in found:
        other = each.other
        frequency_hz, duty = each.best_wave
        rows.append(
            (
                f"{each.power_ratio:g}",
                TITLES[each.defender],
                f"{each.throttle:.1f}",
                f"{each.square:.1f} ({other['square']:g})",
                f"{each.duty:.1f} ({other['duty']:g})",
                f"{frequency_hz:.3g} Hz, {duty:g}",
                f"{each.closed:.1f} ({other['closed']:g})",
                f"{each.verified:.1f} ({other['verified']:g})",
                f"{each.general:.1f}",
            )
        )
    breaks = [k for k in range(len(rows) - 1) if rows[k][0] != rows[k + 1][0]]
    notes = (
        "Contact solid, 60 s, m/s; in brackets what an independent implementation found. square: best of "
        f"{len(STEADY_HZ)} frequencies; duty: best of {len(DUTY_HZ)} frequencies x {len(DUTIES)} duties, with where.",
        "searched: `switching?against=...`; verified: the same at half the step, mean over worlds with drive and drag "
        "changed by up to 0.3 %; general: `switching`, searched against all at once, verified in the same way.",
        "A lower bound of what is possible. The paper's attacker is the square wave.",
    )
    return Block("Head-room above the paper's attacker", columns, rows, 2, notes, breaks)
