"""The reproduction as plain data, ready for JSON."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from cps_baselines.reproduction.findings import findings_document
from cps_baselines.rogue.reproduction.circles import affected, followers, shares_of_rings
from cps_baselines.rogue.reproduction.collision_line import bumper_gap_m, collision_frequency_hz
from cps_baselines.rogue.reproduction.evaluation import FindingsByContact
from cps_baselines.rogue.reproduction.evidence import Evidence, seat_overrides, swaying_ride
from cps_baselines.rogue.reproduction.fit import ORDERINGS, Maps, Variant
from cps_baselines.rogue.reproduction.headroom import HeadRoom
from cps_baselines.rogue.reproduction.parts import CIRCLED
from cps_baselines.rogue.reproduction.reference import Check
from cps_baselines.rogue.reproduction.settings import (
    CONTACTS,
    COURSE_FREQUENCIES_HZ,
    FREQUENCIES_HZ,
    MAPS,
    RATIOS,
    SEAT_RATIOS,
    SEATED,
    SEATS,
    SWAYS,
)
from cps_envs.rogue.config import PAPER


def courses_document(evidence: Evidence, defenders: Sequence[str]) -> list[dict[str, Any]]:
    """Damage and the leader's distance behind its reference, second by second."""
    rows = []
    for defender in defenders:
        for frequency_hz in COURSE_FREQUENCIES_HZ:
            course = evidence.course(defender, frequency_hz)
            moments = [course.at(second) for second in range(int(course.config.duration_s) + 1)]
            rows.append(
                {
                    "defender": defender,
                    "frequency_hz": frequency_hz,
                    "damage": course.damage[moments].tolist(),
                    "leader_behind_m": course.behind_m[moments, -1].tolist(),
                    "disbanded_s": course.disbanded_s,
                }
            )
    return rows


def sways_document(evidence: Evidence) -> list[dict[str, Any]]:
    """The courses of Fig. 5.2: places relative to those on the reference, and the damage, decision by decision."""
    rides = [(attacker, evidence[swaying_ride(attacker)]) for attacker in SWAYS]
    return [
        {"attacker": attacker, "ahead_m": (-course.behind_m).tolist(), "damage": course.damage.tolist()}
        for attacker, course in rides
    ]


def circles_document(evidence: Evidence) -> list[dict[str, Any]]:
    """Shares of the time in the circles of Fig. 5.4, and in which a_m matters."""
    courses = [(each, evidence.course(CIRCLED, each)) for each in COURSE_FREQUENCIES_HZ]
    return [
        {
            "frequency_hz": frequency_hz,
            "vehicle": errors.vehicle + 1,
            "shares": shares_of_rings(errors, course.config).tolist(),
            "affected": float(affected(errors, course.config).mean()),
        }
        for frequency_hz, course in courses
        for errors in followers(course)
    ]


def seats_document(evidence: Evidence) -> list[dict[str, Any]]:
    """Every cell of the maps of other seats."""
    return [
        {
            "num_vehicles": num_vehicles,
            "seat": seat,
            "defender": name,
            "contact": contact,
            "unit": unit,
            "ratios": list(SEAT_RATIOS),
            "frequencies_hz": list(FREQUENCIES_HZ),
            "damage": evidence.under(contact)
            .map(name, SEAT_RATIOS, seat_overrides(num_vehicles, seat))
            .damage.tolist(),
        }
        for num_vehicles, seats in SEATS.items()
        for seat in seats
        for name in SEATED
        for contact, unit in CONTACTS.items()
    ]


def maps_document(evidence: Evidence) -> dict[str, Any]:
    """Every cell, and the collision line for both gaps."""
    maps = [
        {
            "figure": figure,
            "defender": defender,
            "contact": contact,
            "unit": unit,
            "maximum": heat_map.highest,
            "mean": heat_map.mean,
            "peak": heat_map.peak,
            "ratios": list(heat_map.ratios),
            "frequencies_hz": list(heat_map.frequencies_hz),
            "damage": heat_map.damage.tolist(),
        }
        for contact, unit in CONTACTS.items()
        for figure, defender in MAPS.items()
        for heat_map in [evidence.under(contact).map(defender)]
    ]
    gaps = {"bumpers": bumper_gap_m(), "centres": PAPER.separation_m}
    line = {name: [collision_frequency_hz(ratio, gap_m) for ratio in RATIOS] for name, gap_m in gaps.items()}
    return {"maps": maps, "collision_line_hz": {"ratios": list(RATIOS), **line}}


def claims_document(findings: FindingsByContact) -> dict[str, Any]:
    """Every claim with our finding, by contact."""
    return {contact: findings_document(found) for contact, found in findings.items()}


def fit_document(found: Iterable[tuple[Variant, Maps, list[bool]]]) -> dict[str, Any]:
    """Which orderings survive."""
    variants = [
        {
            "variant": variant.name,
            "contact": variant.contact,
            "hold": hold,
            "maxima": {defender: heat_map.highest for defender, heat_map in maps.items()},
            "means": {defender: heat_map.mean for defender, heat_map in maps.items()},
        }
        for variant, maps, hold in found
    ]
    return {"orderings": list(ORDERINGS), "variants": variants}


def head_room_document(found: Sequence[HeadRoom]) -> list[dict[str, Any]]:
    """The table with the other implementation's."""
    return [{**asdict(each), "other": each.other} for each in found]


def checks_document(checks: Sequence[Check]) -> list[dict[str, Any]]:
    """The regression check."""
    return [
        {
            "what": check.reference.label,
            "ours": check.ours,
            "reference": check.reference.damage,
            "tolerance": check.reference.tolerance,
            "passed": check.passed,
        }
        for check in checks
    ]
