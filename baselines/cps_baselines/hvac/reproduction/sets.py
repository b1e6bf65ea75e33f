"""Fig. 4.6: the sensor sets while sensor 2 shows a negative bias, by their residuals and by MTD1's choices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_baselines.hvac.reproduction.experiments import second_zone
from cps_baselines.hvac.reproduction.recording import Course
from cps_baselines.reproduction.evidence import Evidence
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
