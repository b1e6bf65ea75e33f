"""Fig. 4.6: MTD1 while sensor 2 shows a negative bias."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.courses import ERROR, HOURS, ONSET, draw_zones, name_zones
from cps_baselines.hvac.reproduction.experiments import second_zone
from cps_baselines.hvac.reproduction.recording import Course
from cps_baselines.hvac.reproduction.sets import SetCourse, residuals, set_courses
from cps_baselines.reproduction.figures import dress, new_figure, shades

DAY = 0  # the seed that is drawn


def draw(evidence: Evidence) -> Any:
    """All five panels."""
    course, sets = evidence[second_zone()], set_courses(evidence)
    figure = new_figure(13.0, 8.5)
    panels = figure.subplot_mosaic([["a", "a", "a", "b", "b", "b"], ["c", "c", "d", "d", "e", "e"]])
    intact, flawed = [each for each in sets if each.intact], [each for each in sets if not each.intact]
    _residuals(panels["a"], course, intact, "a) J of the intact sets")
    _residuals(panels["b"], course, flawed, "b) J of the flawed sets")
    title = "c) Absolute tracking error under MTD1"
    draw_zones(panels["c"], course.time_h, course.tracking_error_c[:, DAY], title=title, y=ERROR)
    start = course.config.window_steps
    hours, errors = course.time_h[start:-1], course.estimation_error_c[start:, DAY]
    draw_zones(panels["d"], hours, errors, title="d) Absolute estimation error under MTD1", y=ERROR)
    for name in ("c", "d"):
        panels[name].set_ylim(0.0)
        name_zones(panels[name])
    _selected(panels["e"], course, flawed)
    for name in ("a", "b", "c", "d", "e"):
        panels[name].axvline(course.time_h[course.onset_step], **ONSET)
    figure.suptitle("Fig. 4.6 recomputed (one day, sensor 2 reads 22 °C); dotted: attack and defence start")
    return figure


def _residuals(axes: Any, course: Course, sets: Sequence[SetCourse], title: str) -> None:
    start = course.config.window_steps
    for each, color in zip(sets, shades(len(sets)), strict=True):
        values = residuals(course)[start:, DAY, each.index - 1]
        label = f"{each.index}: {', '.join(f's{sensor}' for sensor in each.sensors)}"
        axes.plot(course.time_h[start:-1], values, color=color, linewidth=0.6, label=label)
    dress(axes, title, HOURS, "J / °C²", x_limits=(0.0, 24.0))
    axes.set_yscale("log")
    axes.set_ylim(1e-4, 1e2)
    axes.set_xticks(range(0, 25, 4))
    legend = axes.legend(fontsize=8, frameon=False, loc="upper left")
    for line in legend.get_lines():
        line.set_linewidth(2.0)


def _selected(axes: Any, course: Course, flawed: Sequence[SetCourse]) -> None:
    start = course.config.window_steps
    chosen = course.choice[start:, DAY]
    axes.plot(course.time_h[start:-1], chosen, ".", color="0.2", markersize=2.0)
    for each in flawed:
        axes.axhspan(each.index - 0.5, each.index + 0.5, color="tab:red", alpha=0.12, linewidth=0.0)
    dress(axes, "e) Sets selected by MTD1; shaded: flawed", HOURS, "index", x_limits=(0.0, 24.0))
    axes.set_yticks(range(1, 15))
    axes.set_xticks(range(0, 25, 4))
