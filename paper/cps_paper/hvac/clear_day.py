"""The attack-free, noise-free day of Figs. 4.2 and 4.3, read zone by zone, and the claims C01 to C10 about it."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from cps_paper.claims import Claim, Finding, joined
from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import ENERGIES_W, noise_free
from cps_paper.hvac.rules import ALWAYS, CLAIMS, of_printed
from cps_paper.hvac.scenario import DayCourse
from cps_paper.verdicts import REPRODUCED, by_construction, of_cases

START_H, NOON_H, AFTERNOON_H = 1.0, 12.0, 13.0  # all zones start 1 C below the reference; that is over after an hour
OUTER_ZONES = (3, 4)  # which face the outside


@dataclass(frozen=True)
class ZoneDay:
    """What one zone went through."""

    zone: int
    morning_error_c: float  # largest |x - x_r| from START_H to noon
    afternoon_error_c: float  # largest after AFTERNOON_H
    morning_heating_w: float  # mean from START_H to noon
    heated_hours: tuple[int, ...]  # hours of that time in which it was heated at all
    below_share: float  # of all heated steps: measured below the reference; 0 without any


@dataclass(frozen=True)
class EnergyDay:
    """Zone 1 under one input energy."""

    energy_w: float
    usual_level_percent: float  # the most frequent level of the heated steps
    on_share: float  # of all steps
    largest_error_c: float  # from START_H on


def zone_days(evidence: HvacEvidence) -> list[ZoneDay]:
    """Fig. 4.2."""
    course = evidence[noise_free(ENERGIES_W[0])]
    return [_zone_day(course, zone) for zone in range(1, course.config.num_zones + 1)]


def energy_days(evidence: HvacEvidence) -> list[EnergyDay]:
    """Fig. 4.3."""
    days = []
    for energy_w in ENERGIES_W:
        course = evidence[noise_free(energy_w)]
        level = course.level_percent[:, 0, 0]
        levels, counts = np.unique(level[level > 0].round(6), return_counts=True)
        largest = course.tracking_error_c[course.between(START_H, 24.0), 0, 0].max()
        usual = float(levels[counts.argmax()]) if len(levels) else 0.0
        days.append(EnergyDay(energy_w, usual, float(np.mean(level > 0)), float(largest)))
    return days


def clear_day_table(evidence: HvacEvidence) -> ExhibitTable:
    """Fig. 4.2 in numbers."""
    note = (
        f"Largest tracking errors from {START_H:g} h to noon and after 13 h; mean heating from {START_H:g} to "
        f"{NOON_H:g} h and when it ended; heated steps of the day in which the zone was measured below 25 °C."
    )
    title = "Fig. 4.2: attack-free day, without noise"
    return ExhibitTable(title, ZONE_COLUMNS, zone_days(evidence), (note,), data=asdict)


def energies_table(evidence: HvacEvidence) -> ExhibitTable:
    """Fig. 4.3 in numbers."""
    levels = dict(zip(ENERGIES_W, map(CLAIMS.number, ("C06", "C07", "C08")), strict=True))
    worst = CLAIMS.number("C10")
    columns = (
        Column("E", "energy_w", "{:g} W"),
        Column("usual level (paper)", lambda day: (day.usual_level_percent, levels[day.energy_w]), "{:g} % ({:g} %)"),
        Column("on-time", lambda day: 100.0 * day.on_share, "{:.0f} %"),
        Column("largest error (paper)", lambda day: (day.largest_error_c, worst), "{:.2f} °C (below {:g})"),
    )
    return ExhibitTable("Fig. 4.3: zone 1 with three input energies", columns, energy_days(evidence), data=asdict)


ZONE_COLUMNS = (
    Column("zone", "zone"),
    Column("before noon", "morning_error_c", "{:.2f} °C"),
    Column("after 13 h", "afternoon_error_c", "{:.2f} °C"),
    Column("heating", "morning_heating_w", "{:.1f} W"),
    Column("none after", lambda day: max(day.heated_hours, default=-1) + 1, "{} h"),
    Column("below 25 °C", lambda day: 100.0 * day.below_share, "{:.0f} %"),
)


def _zone_day(course: DayCourse, zone: int) -> ZoneDay:
    error, heating = course.tracking_error_c[:, 0, zone - 1], course.heating_w[:, 0, zone - 1]
    morning = course.between(START_H, NOON_H)
    hours = [hour for hour in range(int(START_H), int(NOON_H)) if heating[course.between(hour, hour + 1.0)].any()]
    readings = course.reading_c[:-1, 0, zone - 1][heating > 0]
    return ZoneDay(
        zone,
        morning_error_c=float(error[morning].max()),
        afternoon_error_c=float(error[course.between(AFTERNOON_H, 24.0)].max()),
        morning_heating_w=float(heating[morning].mean()),
        heated_hours=tuple(hours),
        below_share=float(np.mean(readings < course.config.reference_range_c[0])) if len(readings) else 0.0,
    )


MORNING = f"{START_H:g} to {NOON_H:g} h"


@CLAIMS.judges("C01")
def errors_around(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The largest error of each zone, once all have warmed up, to the digits that the paper prints."""
    largest = [max(day.morning_error_c, day.afternoon_error_c) for day in zone_days(evidence)]
    hold = [of_printed(error, claim) == REPRODUCED for error in largest]
    return Finding(max(largest), f"largest {joined(largest, '.2f')} °C after {START_H:g} h", of_cases(hold))


@CLAIMS.judges("C02")
def outer_zones_exceed(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The largest error of zones 3 and 4 in the morning."""
    largest = [day.morning_error_c for day in zone_days(evidence) if day.zone in OUTER_ZONES]
    hold = [error > 1.0 for error in largest]
    return Finding.of_cases(hold, f"largest {joined(largest, '.2f')} °C from {MORNING}")


@CLAIMS.judges("C03")
def outer_zones_unheated(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Hours of the morning in which zones 3 and 4 are not heated at all."""
    days = [day for day in zone_days(evidence) if day.zone in OUTER_ZONES]
    hold = [hour not in day.heated_hours for day in days for hour in range(int(START_H), int(NOON_H))]
    last = joined([max(day.heated_hours, default=-1) + 1 for day in days])
    shown = (
        f"mean {joined([day.morning_heating_w for day in days], '.1f')} W from {MORNING}, none after {last} h; "
        f"{sum(hold)} of {len(hold)} hours without"
    )
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("C04")
def heats_only_below(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Heated steps in which the measured temperature is below the reference, by zone."""
    shares = [day.below_share for day in zone_days(evidence)]
    hold = [share >= ALWAYS for share in shares]
    shown = f"{joined([100.0 * share for share in shares])} % of the heated steps; it heats ahead of the cold"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("C05")
def reference(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The configuration's."""
    ours = noise_free(ENERGIES_W[0]).config.reference_range_c[0]
    return Finding(ours, f"{ours:g} °C, an input", by_construction(of_printed(ours, claim)))


@CLAIMS.judges("C06", "C07", "C08")
def usual_level(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The most frequent level of the heated steps of zone 1 under one of the energies."""
    day = energy_days(evidence)[int(claim.id[1:]) - 6]
    shown = f"{day.usual_level_percent:g} % of {day.energy_w:g} W most often"
    return Finding(day.usual_level_percent, shown, of_printed(day.usual_level_percent, claim))


@CLAIMS.judges("C09")
def shorter_with_energy(evidence: HvacEvidence, claim: Claim) -> Finding:
    """On-times from the lowest energy to the highest."""
    shares = [day.on_share for day in reversed(energy_days(evidence))]
    energies = joined([energy_w / 1000.0 for energy_w in reversed(ENERGIES_W)], "g")
    shown = f"on in {joined(shares, '.2f')} of the steps at {energies} kW"
    return Finding.of_comparisons(shares[:-1], shares[1:], shown)


@CLAIMS.judges("C10")
def worst_error(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The largest error of zone 1 under any energy."""
    worst = max(day.largest_error_c for day in energy_days(evidence))
    return Finding(worst, f"{worst:.2f} °C after {START_H:g} h", of_cases([worst < claim.number]))
