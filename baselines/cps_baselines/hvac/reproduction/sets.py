"""Fig. 4.6: the sensor sets under a negative bias of sensor 2, by residuals and MTD1's choices; claims C29 and C30."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.experiments import FIGURE_4_6_DAYS, second_zone
from cps_baselines.hvac.reproduction.recording import Course
from cps_baselines.hvac.reproduction.rules import CLAIMS
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.exhibit import Column, Table, with_properties
from cps_baselines.reproduction.verdicts import of_cases
from cps_envs.core.types import FloatArray
from cps_envs.hvac.sensors import sensor_sets

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


def set_courses(evidence: Evidence) -> list[SetCourse]:
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


def residuals(course: Course) -> FloatArray:
    """J_a of the steps in which something was decided, (K - 1, B, sets) C2."""
    return course.residual_c2[:-1]


def sets_table(evidence: Evidence) -> Table:
    """Fig. 4.6 in numbers."""
    note = (
        f"Medians over {FIGURE_4_6_DAYS} days from the onset on, °C²; late: once the window holds forged readings only."
    )
    data = with_properties("intact", "selected")
    title = "Fig. 4.6: sensor 2 reads 22 °C"
    return Table(title, COLUMNS, set_courses(evidence), (note,), left=3, data=data)


COLUMNS = (
    Column("set", "index"),
    Column("sensors", lambda each: ", ".join(f"s{sensor}" for sensor in each.sensors)),
    Column("", lambda each: "intact" if each.intact else "flawed"),
    Column("J", "residual_c2", "{:.3f}"),
    Column("J, late", "late_residual_c2", "{:.3f}"),
    Column("selected by MTD1", lambda each: 100.0 * each.selected_share, "{:.1f} %"),
)


@CLAIMS.judges("C29")
def flawed_above_intact(evidence: Evidence, claim: Claim) -> Finding:
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
    return Finding(all(hold), shown, of_cases(hold))


@CLAIMS.judges("C30")
def selected_by_mtd1(evidence: Evidence, claim: Claim) -> Finding:
    """Sets selected, each against the paper's list."""
    courses, paper = set_courses(evidence), {int(number) for number in claim.numbers}
    hold = [each.selected == (each.index in paper) for each in courses]
    ours = [each.index for each in courses if each.selected]
    more = [each for each in courses if each.selected and each.index not in paper]
    shown = ", ".join(map(str, ours))
    shown += "".join(f"; set {each.index} in {100.0 * each.selected_share:.0f} % of the steps" for each in more)
    return Finding(tuple(map(float, ours)), shown, of_cases(hold))
