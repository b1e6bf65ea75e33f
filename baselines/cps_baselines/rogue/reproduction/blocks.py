"""The reproduction as tables of text, ready for a terminal or a page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from cps_baselines.reproduction.block import Block
from cps_baselines.rogue.reproduction.circles import affected, followers, radii_m, shares_of_rings
from cps_baselines.rogue.reproduction.claims import RULES
from cps_baselines.rogue.reproduction.collision_line import bumper_gap_m, collision_frequency_hz
from cps_baselines.rogue.reproduction.evaluation import FindingsByContact
from cps_baselines.rogue.reproduction.evidence import Evidence, seat_overrides, swaying_ride
from cps_baselines.rogue.reproduction.fit import ORDERINGS, Maps, Variant
from cps_baselines.rogue.reproduction.headroom import DUTIES, DUTY_HZ, HeadRoom
from cps_baselines.rogue.reproduction.parts import CIRCLED
from cps_baselines.rogue.reproduction.settings import (
    CONTACTS,
    COURSE_FREQUENCIES_HZ,
    FREQUENCIES_HZ,
    MAPS,
    RATIOS,
    SEAT_RATIOS,
    SEATED,
    SEATS,
    STEADY_HZ,
    SWAYS,
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


def sway_block(evidence: Evidence) -> Block:
    """Fig. 5.2 in numbers."""
    columns = ("attacker", "first contact, s", "its closing speed, m/s", "fastest then, m/s", "D, m/s", "least gap, m")
    rows = []
    for attacker in SWAYS:
        course = evidence[swaying_ride(attacker)]
        hits = np.flatnonzero(course.damage > 0)
        first = int(hits[0]) if len(hits) else None
        gap_m = float(course.separation_m.min()) - course.config.vehicle_length_m
        rows.append(
            (
                f"`{attacker}`",
                DASH if first is None else f"{course.time_s[first]:.1f}",
                DASH if first is None else f"{course.damage[first]:.1f}",
                DASH if first is None else f"{course.speed_mps[first - 1].max():.1f}",
                f"{course.final_damage:.1f}",
                f"{gap_m:.1f}",
            )
        )
    notes = (
        "Preset oscillation: ten vehicles by the linear law (5.15), the attacker at the rear, solid bodies. After one "
        "second at full effort it drives by (5.15) too: with the platoon's gains, or with the sign of k_d reversed.",
        "The paper names neither the gains nor the platoon of this figure, which is from an earlier study.",
    )
    return Block("Fig. 5.2: an attacker that changes its gains", columns, rows, 1, notes)


def circles_block(evidence: Evidence) -> Block:
    """Fig. 5.4 in numbers."""
    radii = radii_m(PAPER)
    rings = (f"below {radii[0]:g} m", *(f"to {radius:g} m" for radius in radii[1:]), "beyond")
    columns = ("vehicle", "f, Hz", *rings, "a_m matters")
    rows = []
    for frequency_hz in COURSE_FREQUENCIES_HZ:
        course = evidence.course(CIRCLED, frequency_hz)
        for errors in followers(course):
            shares = shares_of_rings(errors, course.config)
            matters = float(affected(errors, course.config).mean())
            cells = (f"{errors.vehicle + 1}", f"{frequency_hz:g}", *(f"{share:.0%}" for share in shares))
            rows.append((*cells, f"{matters:.1%}"))
    notes = (
        f"{TITLES[CIRCLED]}, contact pass, equal power: the vehicles next to the attacker, from their alarm until "
        "human drivers take over; 1 m/s counts as 1 m. Errors to the separation that has grown.",
        "a_m matters: share of the time in which n_3 a_max and a_max lead to different efforts.",
    )
    return Block("Fig. 5.4: how long the errors are in which circle", columns, rows, 2, notes)


def seats_block(evidence: Evidence) -> Block:
    """The maps of other seats and platoons in numbers."""
    columns = ("vehicles", "seat", "", "pass: maximum", "mean, m", "solid: maximum", "mean, m/s")
    rows = []
    for num_vehicles, seats in SEATS.items():
        for seat, name in product(seats, SEATED):
            overrides = seat_overrides(num_vehicles, seat)
            maps = [evidence.under(contact).map(name, SEAT_RATIOS, overrides) for contact in CONTACTS]
            numbers = [text for each in maps for text in (f"{each.highest:.1f}", f"{each.mean:.1f}")]
            rows.append((str(num_vehicles), str(seat), TITLES[name], *numbers))
    breaks = [k for k in range(len(rows) - 1) if rows[k][:2] != rows[k + 1][:2]]
    notes = (
        f"Seat 1 is the rear. {len(FREQUENCIES_HZ)} frequencies, power ratios "
        f"{', '.join(f'{ratio:g}' for ratio in SEAT_RATIOS)}; the paper's attacker has seat 3 of 5.",
    )
    return Block("The attacker in other seats", columns, rows, 3, notes, breaks)


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
