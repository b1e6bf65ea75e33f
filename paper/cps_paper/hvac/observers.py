"""Figs. 4.5 and 4.6: what the observer and the sensor sets err by, and the claims about them.

Fig. 4.5 says how far the observer is off with few sensors and short windows; Fig. 4.6 shows the sensor sets under a
negative bias of sensor 2, by residuals and MTD1's choices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray
from cps_envs.hvac.sensors import sensor_sets
from cps_paper.claims import Claim, Finding, joined
from cps_paper.exhibit import Column, ExhibitTable, across, with_properties
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import (
    FIGURE_4_5_DAYS,
    FIGURE_4_6_DAYS,
    OBSERVERS,
    Case,
    observed,
    second_zone,
)
from cps_paper.hvac.rules import CLAIMS, PARTICULAR, of_printed
from cps_paper.hvac.scenario import DayCourse
from cps_paper.verdicts import by_construction, of_cases

LONG, SHORT, TWO, THREE = OBSERVERS
LARGEST = {"C15": (LONG, 1), "C16": (LONG, 3), "C17": (LONG, 4), "C19": (SHORT, 1), "C20": (SHORT, 3)}  # case, zone
START = {"C18": LONG, "C21": SHORT}
IMPROVED = {"C44": (SHORT, LONG), "C45": (SHORT, TWO)}
ALIKE = {"C22": TWO, "C23": THREE}


def largest_errors_c(evidence: HvacEvidence, case: Case) -> FloatArray:
    """The largest |xh - x| of each day and zone (B, n), C, once the window is full."""
    course = evidence[observed(*case)]
    largest: FloatArray = course.estimation_error_c[course.config.window_steps :].max(axis=0)
    return largest


def start_h(evidence: HvacEvidence, case: Case) -> float:
    """When the estimation starts, h."""
    config = evidence[observed(*case)].config
    return config.window_steps * config.step_s / 3600.0


@CLAIMS.judges(*LARGEST)
def largest_error(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The largest estimation error of a zone; it differs from day to day by the noise."""
    case, zone = LARGEST[claim.id]
    days = largest_errors_c(evidence, case)[:, zone - 1]
    ours = float(np.median(days))
    shown = f"{ours:.3f} °C (median of {len(days)} days, {days.min():.2f} to {days.max():.2f})"
    return Finding.of_number(ours, claim, shown)


@CLAIMS.judges("C43")
def outer_zones_fail_most(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The error of zones 1 and 3 with the short window against twice that of zones 2 and 4."""
    largest = np.median(largest_errors_c(evidence, SHORT), axis=0).tolist()
    hold = [largest[zone - 1] > PARTICULAR * largest[other - 1] for zone in (1, 3) for other in (2, 4)]
    shown = f"largest {joined(largest, '.2f')} °C in zones 1 to 4 with N_e = {SHORT[1]}"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges(*START)
def estimation_starts(evidence: HvacEvidence, claim: Claim) -> Finding:
    """When the window is full, by construction."""
    ours = start_h(evidence, START[claim.id])
    return Finding(ours, f"{ours:.2f} h, the window", by_construction(of_printed(ours, claim)))


@CLAIMS.judges(*ALIKE)
def zones_alike(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Whether every zone's estimate is as good as a measurement: never off by more than one standard deviation."""
    case = ALIKE[claim.id]
    limit_c = evidence[observed(*case)].config.noise_std_c
    largest = np.median(largest_errors_c(evidence, case), axis=0)
    hold = [bool(error <= limit_c) for error in largest]
    shown = f"largest {joined(largest.tolist(), '.2f')} °C in zones 1 to 4; a reading is off by {limit_c:.2f} °C"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges(*IMPROVED)
def improved(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The largest estimation errors of all zones with less, and with more, to go by."""
    less, more = (np.median(largest_errors_c(evidence, case), axis=0).tolist() for case in IMPROVED[claim.id])
    shown = f"largest {joined(less, '.2f')} °C in zones 1 to 4 become {joined(more, '.2f')} °C"
    return Finding.of_comparisons(less, more, shown)


def observers_table(evidence: HvacEvidence) -> ExhibitTable:
    """Fig. 4.5 in numbers."""
    papers = {place: CLAIMS.number(name) for name, place in LARGEST.items()}

    def errors(case: Case, zone: int) -> str:
        days = largest_errors_c(evidence, case)[:, zone - 1]
        paper = f"\npaper {papers[case, zone]:g}" if (case, zone) in papers else ""
        return f"{np.median(days):.2f} ({days.min():.2f}-{days.max():.2f}){paper}"

    columns = (
        Column("sensors", lambda case: ", ".join(f"s{sensor}" for sensor in case[0])),
        Column("N_e", lambda case: case[1]),
        Column("starts", lambda case: evidence[observed(*case)].time_h[case[1]], "{:.2f} h"),
        *across(range(1, 5), "zone {}".format, errors),
    )
    note = f"Largest estimation error in °C: median (range) over {FIGURE_4_5_DAYS} days; paper: where it gives one."
    title = "Fig. 4.5: the observer with few sensors"
    return ExhibitTable(title, columns, OBSERVERS, (note,), data=lambda case: _data(evidence, case))


def _data(evidence: HvacEvidence, case: Case) -> dict[str, Any]:
    largest = largest_errors_c(evidence, case)
    return {
        "sensors": case[0],
        "window_steps": case[1],
        "start_h": start_h(evidence, case),
        "largest_error_c": {
            "median": np.median(largest, axis=0).tolist(),
            "lowest": largest.min(axis=0).tolist(),
            "highest": largest.max(axis=0).tolist(),
        },
    }


ATTACKED = 2  # sensor
SELECTED_SHARE = 0.01  # of the steps; below it, the window still holds readings from before the attack


@dataclass(frozen=True)
class SetCourse:
    """One sensor set from the onset on."""

    index: int  # from 1, in the order of (4.31)
    sensors: tuple[int, ...]
    residual_c2: float  # median of J_a
    late_residual_c2: float  # median once the window holds the attack alone
    selected_share: float  # of the steps, by MTD1

    @property
    def intact(self) -> bool:
        """Whether it does without the attacked sensor."""
        return ATTACKED not in self.sensors

    @property
    def selected(self) -> bool:
        """Whether MTD1 uses it."""
        return self.selected_share >= SELECTED_SHARE


def set_courses(evidence: HvacEvidence) -> list[SetCourse]:
    """All sets in the order of (4.31)."""
    course = evidence[second_zone()]
    early, late = course.onset_step, course.onset_step + course.config.window_steps
    chosen = course.choice[early:]
    return [
        SetCourse(
            index,
            sensors,
            residual_c2=float(np.median(residuals(course)[early:, :, index - 1])),
            late_residual_c2=float(np.median(residuals(course)[late:, :, index - 1])),
            selected_share=float(np.mean(chosen == index)),
        )
        for index, sensors in enumerate(sensor_sets(course.config), 1)
    ]


def residuals(course: DayCourse) -> FloatArray:
    """J_a of the steps in which something was decided, (K - 1, B, sets) C2."""
    return course.residual_c2[:-1]


def sets_table(evidence: HvacEvidence) -> ExhibitTable:
    """Fig. 4.6 in numbers."""
    note = (
        f"Medians over {FIGURE_4_6_DAYS} days from the onset on, °C²; late: once the window holds forged readings only."
    )
    data = with_properties("intact", "selected")
    title = "Fig. 4.6: sensor 2 reads 22 °C"
    return ExhibitTable(title, COLUMNS, set_courses(evidence), (note,), left=3, data=data)


COLUMNS = (
    Column("set", "index"),
    Column("sensors", lambda each: ", ".join(f"s{sensor}" for sensor in each.sensors)),
    Column("", lambda each: "intact" if each.intact else "flawed"),
    Column("J", "residual_c2", "{:.3f}"),
    Column("J, late", "late_residual_c2", "{:.3f}"),
    Column("selected by MTD1", lambda each: 100.0 * each.selected_share, "{:.1f} %"),
)


@CLAIMS.judges("C29")
def flawed_above_intact(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The median residual of every flawed set against the largest of an intact one."""
    courses = set_courses(evidence)
    highest = max(each.residual_c2 for each in courses if each.intact)
    flawed = [each for each in courses if not each.intact]
    hold = [each.residual_c2 > highest for each in flawed]
    below = [each for each, holds in zip(flawed, hold, strict=True) if not holds]
    above = [each.residual_c2 for each, holds in zip(flawed, hold, strict=True) if holds]
    shown = (
        f"intact up to {highest:.2f}; {len(above)} of {len(flawed)} flawed {joined([min(above), max(above)], '.1f')}"
    )
    shown += "".join(
        f"; set {each.index} {each.residual_c2:.3f}, later {each.late_residual_c2:.3f} °C²" for each in below
    )
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("C30")
def selected_by_mtd1(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Sets selected, each against the paper's list."""
    courses, paper = set_courses(evidence), {int(number) for number in claim.numbers}
    hold = [each.selected == (each.index in paper) for each in courses]
    ours = [each.index for each in courses if each.selected]
    more = [each for each in courses if each.selected and each.index not in paper]
    shown = ", ".join(map(str, ours))
    shown += "".join(f"; set {each.index} in {100.0 * each.selected_share:.0f} % of the steps" for each in more)
    return Finding(tuple(map(float, ours)), shown, of_cases(hold))
