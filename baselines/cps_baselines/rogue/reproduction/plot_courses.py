"""Figs. 5.3 and 5.5: separations, positions and damage of an attack at equal power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cps_baselines.reproduction.figures import dress, new_figure, shades
from cps_baselines.rogue.reproduction.course import Course
from cps_baselines.rogue.reproduction.evidence import Evidence
from cps_baselines.rogue.reproduction.settings import COURSE_FREQUENCIES_HZ, DRAWN_HZ, TITLES

TIME = "time / s"
ATTACKER = "tab:red"
STYLES = ("-", "--", ":")


def draw(evidence: Evidence, number: str, defenders: Sequence[str]) -> Any:
    """A column of panels per defender; damage for all frequencies, the rest for DRAWN_HZ."""
    figure = new_figure(6.4 * len(defenders) + 0.6, 9.0)
    panels = figure.subplots(3, len(defenders), sharex=True, sharey="row", squeeze=False)
    for column, defender in zip(panels.T, defenders, strict=True):
        course = evidence.course(defender, DRAWN_HZ)
        _separations(column[0], course, defender)
        _places(column[1], course)
        _damages(column[2], [evidence.course(defender, each) for each in COURSE_FREQUENCIES_HZ])
        for panel in column[:2]:
            _mark_disbanding(panel, course)
    panels[0, 0].legend(fontsize=8, frameon=False, ncols=2)
    panels[1, 0].legend(fontsize=8, frameon=False, ncols=2)
    panels[2, 0].legend(fontsize=8, frameon=False, title="attack frequency", title_fontsize=8)
    figure.suptitle(f"Fig. {number} recomputed: square wave of {DRAWN_HZ:g} Hz, equal power, contact `pass`")
    return figure


def _separations(panel: Any, course: Course, defender: str) -> None:
    for pair, color in enumerate(shades(course.separation_m.shape[1])):
        touches = course.attacker in (pair, pair + 1)
        label = f"{pair + 1}-{pair + 2}" + (" (attacker)" if touches else "")
        panel.plot(course.time_s, course.separation_m[:, pair], color=color, linewidth=1.4, label=label)
    panel.set_yscale("symlog", linthresh=20.0)
    lowest_m = min(float(course.separation_m.min()), 0.0)
    panel.axhspan(1.5 * lowest_m, course.config.vehicle_length_m, color="0.9", zorder=0)
    panel.axhline(0.0, color="0.6", linewidth=0.6)
    dress(panel, f"{TITLES[defender]}: separations (grey: overlapping or overtaken)", TIME, "separation / m")


def _places(panel: Any, course: Course) -> None:
    vehicles = course.position_m.shape[1]
    for vehicle, color in enumerate(shades(vehicles)):
        seized = vehicle == course.attacker
        style = {"color": ATTACKER, "linewidth": 4.0} if seized else {"color": color, "linewidth": 1.4}
        label = f"{vehicle + 1}" + {course.attacker: " (attacker)", vehicles - 1: " (leader)"}.get(vehicle, "")
        panel.plot(course.time_s, -course.behind_m[:, vehicle], label=label, **style)
    panel.axhline(0.0, color="0.6", linewidth=0.6)
    dress(panel, "Positions relative to their places on the reference", TIME, "ahead of the place / m")


def _damages(panel: Any, courses: Sequence[Course]) -> None:
    for course, frequency_hz, style in zip(courses, COURSE_FREQUENCIES_HZ, STYLES, strict=True):
        panel.plot(course.time_s, course.damage, style, color="0.15", label=f"{frequency_hz:g} Hz")
        _mark_disbanding(panel, course, style)
    panel.set_yscale("symlog", linthresh=10.0)
    panel.set_ylim(0.0)
    dress(panel, "Total damage (5.8)", TIME, "D / m", x_limits=(0.0, float(np.max(courses[0].time_s))))


def _mark_disbanding(panel: Any, course: Course, style: str = "-") -> None:
    if course.disbanded_s is not None:
        panel.axvline(course.disbanded_s, color="tab:orange", linewidth=1.0, linestyle=style)
