"""Chapter 5 as data: courses, maps, other seats, what is open to attackers, and the claims with both contacts."""

from __future__ import annotations

from dataclasses import replace
from itertools import starmap
from typing import Any

from cps_envs.rogue.config import PAPER
from cps_paper.chapter import Chapter, Judged, Reproduction
from cps_paper.evidence import Experiment, Vary
from cps_paper.exhibit import Exhibit
from cps_paper.recheck import Condition, varying
from cps_paper.rogue import claims_courses, claims_maps, plots, reference
from cps_paper.rogue.claims import CLAIMS, RULES
from cps_paper.rogue.claims_courses import EARLY_DISBANDING, ENDS
from cps_paper.rogue.experiments import (
    Attacked,
    Overrides,
    RogueEvidence,
    calm_ride,
    map_rows,
    searched_ride,
    seat_overrides,
    square_ride,
    steady_waves,
    swaying_ride,
)
from cps_paper.rogue.fit import FURTHER, fits_data, fits_table
from cps_paper.rogue.headroom import head_room_experiments, head_rooms_table
from cps_paper.rogue.heat_map import (
    CIRCLED,
    CONTACTS,
    COURSE_FREQUENCIES_HZ,
    COURSES,
    DISBANDING,
    FREQUENCIES_HZ,
    MAPS,
    PASS,
    SEAT_RATIOS,
    SWAYS,
)
from cps_paper.rogue.maps import every_seat, maps_data, maps_tables, seats_data, seats_table
from cps_paper.rogue.rides import circles_table, courses_table, sways_table
from cps_paper.rogue.summary import closing, has_maps
from cps_paper.rogue.together import together_experiments, together_table
from cps_paper.rogue.worlds import SPREAD
from cps_paper.verdicts import Check

# Judged again at half the integration step, and in worlds that differ slightly.
WORLDS = 20

HALF_STEP: Overrides = (("dt_s", PAPER.dt_s / 2),)

OTHER_WORLDS: Overrides = tuple(
    (name, (value * (1 - SPREAD), value * (1 + SPREAD)))
    for name, value in (("drive_mps2", float(PAPER.drive_mps2)), ("drag_per_s", float(PAPER.drag_per_s)))  # type: ignore[arg-type]
)


def _varied(overrides: Overrides, seed: int = 0) -> Vary:
    """The same course or the same damages under other settings."""
    return varying(Attacked, lambda usual: replace(usual, overrides=(*usual.overrides, *overrides), seed=seed))


CONDITIONS = (
    Condition(f"at half the step ({1e3 * PAPER.dt_s / 2:g} ms)", (_varied(HALF_STEP),)),
    Condition(
        f"in {WORLDS} worlds (drive and drag within {100 * SPREAD:g} %)",
        tuple(_varied(OTHER_WORLDS, seed) for seed in range(1, WORLDS + 1)),
    ),
)


SOURCES = (claims_courses, claims_maps)  # importing them registers the functions that check the claims


def _maps() -> list[Experiment[Any]]:
    return [row for contact in CONTACTS for name in MAPS.values() for row in map_rows(name, contact)]


def _seats() -> list[Experiment[Any]]:
    return [
        row
        for contact in CONTACTS
        for vehicles, seat, name in every_seat()
        for row in map_rows(name, contact, SEAT_RATIOS, seat_overrides(vehicles, seat))
    ]


def behind_claims() -> list[Experiment[Any]]:
    """What the claims need."""
    return _maps() + [each for contact in CONTACTS for each in _claimed(contact)]


def _claimed(contact: str) -> list[Experiment[Any]]:
    """What the claims need beyond the maps."""
    todo: list[Experiment[Any]] = [
        square_ride(name, each, contact) for name in MAPS.values() for each in COURSE_FREQUENCIES_HZ
    ]
    todo.append(calm_ride("disband_2", contact))
    todo += [square_ride("disband_2", each, contact, human_returns=True) for each in COURSE_FREQUENCIES_HZ]
    todo += [square_ride(name, FREQUENCIES_HZ[0], contact, ratio) for name in EARLY_DISBANDING for ratio in ENDS]
    todo += [searched_ride(name, contact) for name in DISBANDING]
    todo += list(starmap(swaying_ride, SWAYS[1:]))
    return todo + [steady_waves(name, contact) for name in ("pd", "sliding", "sliding_detection")]


def _courses(number: str, about: str) -> Exhibit[RogueEvidence]:
    defenders = COURSES[number]
    return Exhibit(
        number,
        f"Fig. {number}: {about}, at equal power",
        lambda seen: [square_ride(name, each, PASS) for name in defenders for each in COURSE_FREQUENCIES_HZ],
        lambda seen: [courses_table(seen, number, defenders)],
        figures={f"figure_{number.replace('.', '_')}": lambda seen: plots.draw(seen, number, defenders)},
    )


JUDGED: Judged[RogueEvidence] = Judged(
    CLAIMS,
    RULES,
    lambda seen: behind_claims(),
    CONDITIONS,
    lambda seen: {contact: seen.under(contact) for contact in CONTACTS},
)
EXHIBITS: tuple[Exhibit[RogueEvidence], ...] = (
    Exhibit(
        "5.2",
        "Fig. 5.2: an attacker at the rear of ten vehicles that changes the gains of its controller",
        lambda seen: list(starmap(swaying_ride, SWAYS)),
        lambda seen: [sways_table(seen)],
        figures={"figure_5_2": plots.draw_sways},
    ),
    _courses("5.3", "the sliding mode without and with detection"),
    Exhibit(
        "5.4",
        "Fig. 5.4: the circles of the modified sliding mode, and where the errors are",
        lambda seen: [square_ride(CIRCLED, each, PASS) for each in COURSE_FREQUENCIES_HZ],
        lambda seen: [circles_table(seen)],
        figures={"figure_5_4": plots.draw_circles},
    ),
    _courses("5.5", "disbanding at +2 m"),
    Exhibit(
        "maps",
        "Figs. 5.6 to 5.11: damage over frequency and power",
        lambda seen: _maps(),
        maps_tables,
        maps_data,
        {
            f"figures_5_6_to_5_11_{contact}": lambda seen, contact=contact: plots.draw_maps(seen.under(contact))  # type: ignore[misc]
            for contact in CONTACTS
        },
    ),
    Exhibit(
        "seats",
        "such maps for every seat of the attacker and platoons of ten; beside them detection over the linear law",
        lambda seen: _seats(),
        lambda seen: [seats_table(seen)],
        seats_data,
        quick=False,
    ),
    Exhibit(
        "together",
        "two attackers in one platoon beside one of twice the power",
        lambda seen: together_experiments(),
        lambda seen: [together_table(seen)],
        quick=False,
    ),
    JUDGED.exhibit,
    Exhibit(
        "fit",
        "how selected the configuration is",
        lambda seen: _maps() + [each for variant in FURTHER for each in variant.experiments()],
        lambda seen: [fits_table(seen)],
        fits_data,
        quick=False,
    ),
    Exhibit(
        "headroom",
        "what square waves and searched attackers can do in the learning problem",
        lambda seen: head_room_experiments(),
        lambda seen: [head_rooms_table(seen)],
        quick=False,
    ),
)


def always(seen: RogueEvidence) -> list[Experiment[Any]]:
    """The cells of the regression check."""
    return [each.experiment for each in reference.damages() if each.experiment is not None]


def checks(found: Reproduction[RogueEvidence]) -> list[Check]:
    """What has a reference; claims that do not hold do not count."""
    return reference.checks(found.evidence, maps=has_maps(found))


def document(found: Reproduction[RogueEvidence]) -> dict[str, Any]:
    """Plain data for JSON."""
    return {
        "chapter": 5,
        "quick": found.evidence.quick,
        "parts": found.data(),
        "again": found.again_data(),
        "regression": list(map(_check, found.checks)),
        "closing": found.closing(),
    }


def _check(check: Check) -> dict[str, Any]:
    return {
        "what": check.label,
        "ours": check.ours,
        "reference": check.reference.value,
        "tolerance": check.reference.tolerance.amount,
        "passed": check.passed,
    }


CHAPTER: Chapter[RogueEvidence] = Chapter(
    title="chapter 5",
    evidence=RogueEvidence,
    reading=lambda seen: "contact",
    exhibits=EXHIBITS,
    closing=closing,
    document=document,
    checks=checks,
    judged=JUDGED,
    always=always,
)
