"""The figures of the chapter, drawn: Figs. 4.2 to 4.8.

They share zones by colour, hours below, the onset, and bars by attacked sensors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray
from cps_paper.figures import dress, new_figure, shades
from cps_paper.hvac.clear_day import energy_days
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import (
    ATTACKS,
    DEFENCES,
    ENERGIES_W,
    OBSERVERS,
    Case,
    first_zone,
    noise_free,
    observed,
    second_zone,
    undefended,
)
from cps_paper.hvac.impacts import failing_line, impacts, outcomes
from cps_paper.hvac.observers import SetCourse, residuals, set_courses
from cps_paper.hvac.scenario import DayCourse

HOURS = "time / h"
TEMPERATURE, ERROR = "temperature / °C", "error / °C"
REFERENCE = {"color": "0.3", "linewidth": 0.9, "linestyle": "--"}
ONSET = {"color": "tab:green", "linewidth": 1.0, "linestyle": ":"}


def draw_zones(axes: Any, time_h: FloatArray, values: FloatArray, *, title: str, y: str, style: str = "-") -> None:
    """One line per zone; values are (K, n) or one step shorter than `time_h` (K,)."""
    for zone, color in enumerate(shades(values.shape[1]), 1):
        label = f"zone {zone}" if style == "-" else None
        axes.plot(time_h[: len(values)], values[:, zone - 1], style, color=color, linewidth=1.0, label=label)
    dress(axes, title, HOURS, y, x_limits=(0.0, 24.0))
    axes.set_xticks(np.arange(0, 25, 4))


def name_zones(axes: Any, **where: Any) -> None:
    """A quiet legend."""
    axes.legend(fontsize=8, frameon=False, **where)


WIDTH = 0.8  # of a group of bars
LOWEST_C2 = 0.8  # where the axis of impacts begins
HEADROOM = 1.12
Groups = Mapping[str, Sequence[float]]  # by name: a value for 0, 1, 2, ... attacked sensors


def draw_impacts(axes: Any, groups: Groups, title: str) -> None:
    """Impacts, on a logarithmic axis."""
    _draw(axes, groups, shades(len(groups)), title, "A_impact / °C²")
    axes.set_yscale("log")
    axes.set_ylim(LOWEST_C2)
    axes.legend(fontsize=8, frameon=False, loc="upper left")


def draw_counts(axes: Any, groups: Groups, title: str, y: str, colors: Sequence[Any]) -> None:
    """Numbers of something, with room for the legend above."""
    _draw(axes, groups, colors, title, y)
    axes.set_ylim(0.0, HEADROOM * max(map(max, groups.values())))
    axes.legend(fontsize=8, frameon=False, loc="upper right", ncols=len(groups))


def _draw(axes: Any, groups: Groups, colors: Sequence[Any], title: str, y: str) -> None:
    width = WIDTH / len(groups)
    for i, ((name, values), color) in enumerate(zip(groups.items(), colors, strict=True)):
        places = [count - WIDTH / 2 + (i + 0.5) * width for count in range(len(values))]
        axes.bar(places, values, width, color=color, label=name)
    counts = range(max(map(len, groups.values())))
    dress(axes, title, "attacked sensors", y)
    axes.set_xticks(list(counts), ["none", *map(str, counts[1:])])
    axes.grid(visible=False, axis="x")


def draw_clear_day(evidence: HvacEvidence) -> Any:
    """All four panels of Fig. 4.2."""
    course = evidence[noise_free(ENERGIES_W[0])]
    figure = new_figure(11.0, 7.0)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"]])
    draw_zones(panels["a"], course.time_h, course.temperature_c[:, 0], title="a) Temperatures", y=TEMPERATURE)
    panels["a"].plot(course.time_h, course.outdoor_c, color="tab:red", linewidth=1.0, label="outside")
    draw_zones(panels["b"], course.time_h, course.reading_c[:, 0], title="b) Measured, enlarged", y=TEMPERATURE)
    for name in ("a", "b"):
        panels[name].axhline(course.config.reference_c, label="reference", **REFERENCE)
    draw_zones(panels["c"], course.time_h, course.tracking_error_c[:, 0], title="c) Absolute tracking errors", y=ERROR)
    panels["c"].set_ylim(0.0)
    draw_zones(panels["d"], course.time_h, course.heating_w[:, 0], title="d) Inputs", y="heating / W")
    name_zones(panels["a"], ncols=2)
    figure.suptitle("Fig. 4.2 recomputed (attack-free, without noise, E = 1 kW)")
    return figure


def draw_energies(evidence: HvacEvidence) -> Any:
    """All four panels of Fig. 4.3."""
    figure = new_figure(11.0, 7.0)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"]])
    for name, day, color in zip("abc", energy_days(evidence), shades(len(ENERGIES_W)), strict=True):
        course = evidence[noise_free(day.energy_w)]
        level = course.level_percent[:, 0, 0]
        panels[name].step(course.time_h[:-1], level, where="post", color=color, linewidth=1.2)
        title = f"{name}) E = {day.energy_w:g} W: on {100.0 * day.on_share:.0f} % of the day"
        dress(panels[name], title, HOURS, "input of zone 1 / % of E", x_limits=(0.0, 24.0))
        panels[name].set_ylim(0.0)
        panels[name].axhline(1.0, label="1 %, where it settles in the paper", **REFERENCE)
        error = course.tracking_error_c[:, 0, 0]
        panels["d"].plot(course.time_h, error, color=color, linewidth=1.2, label=f"{day.energy_w:g} W")
    dress(panels["d"], "d) Absolute tracking error of zone 1", HOURS, ERROR, x_limits=(0.0, 24.0))
    panels["d"].set_ylim(0.0)
    for panel in panels.values():
        panel.set_xticks(range(0, 25, 4))
        name_zones(panel)
    figure.suptitle("Fig. 4.3 recomputed (attack-free, without noise)")
    return figure


DAY = 0  # the seed that is drawn


def draw_undefended(evidence: HvacEvidence) -> Any:
    """All three panels."""
    figure = new_figure(11.0, 7.5)
    panels = figure.subplot_mosaic([["a", "a"], ["b", "c"]])
    impacts = {
        attacker: [float(evidence[undefended(attacker, count)].a_impact.mean()) for count in range(5)]
        for attacker in ATTACKS
    }
    draw_impacts(panels["a"], impacts, "a) A_impact without a defence; sensors fall in the order 1, 2, 3, 4")
    course = evidence[first_zone("constant")]
    title = f"b) Sensor 1 reads 22 °C: A_impact = {evidence[undefended('constant', 1)].a_impact[DAY]:.1f} (paper 149.3)"
    draw_zones(panels["b"], course.time_h, course.temperature_c[:, DAY], title=title, y=TEMPERATURE)
    panels["b"].axhline(course.config.reference_c, label="reference", **REFERENCE)
    title, axis = "c) Inputs in the same case", "heating / % of E"
    draw_zones(panels["c"], course.time_h, course.level_percent[:, DAY], title=title, y=axis)
    for name in ("b", "c"):
        panels[name].axvline(course.time_h[course.onset_step], **ONSET)
    name_zones(panels["b"])
    figure.suptitle("Fig. 4.4 recomputed; dotted: the attack starts")
    return figure


DAY = 0  # the seed that is drawn
LONG, SHORT, TWO, THREE = OBSERVERS
PLACES = {"a": LONG, "b": SHORT, "c": TWO, "d": LONG, "e": SHORT, "f": THREE}


def draw_observers(evidence: HvacEvidence) -> Any:
    """All six panels."""
    figure = new_figure(13.0, 7.0)
    panels = figure.subplot_mosaic([["a", "b", "c"], ["d", "e", "f"]])
    for name, case in PLACES.items():
        course, start = evidence[observed(*case)], case[1]
        axes, hours = panels[name], course.time_h[start:-1]
        if name in "ab":
            title = f"{name}) True, and estimated (dashed): {_said(case)}"
            draw_zones(axes, course.time_h, course.temperature_c[:, DAY], title=title, y=TEMPERATURE)
            estimate = course.estimate_c[start:, DAY]
            draw_zones(axes, hours, estimate, title=title, y=TEMPERATURE, style="--")
        else:
            title = f"{name}) Estimation error: {_said(case)}"
            draw_zones(axes, hours, course.estimation_error_c[start:, DAY], title=title, y=ERROR)
            axes.set_ylim(0.0)
        axes.axvline(course.time_h[start], **ONSET)
    name_zones(panels["a"])
    figure.suptitle("Fig. 4.5 recomputed (one day); dotted: the estimation starts")
    return figure


def _said(case: Case) -> str:
    sensors, window = case
    return f"{', '.join(f's{sensor}' for sensor in sensors)}, N_e = {window}"


DAY = 0  # the seed that is drawn


def draw_sets(evidence: HvacEvidence) -> Any:
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


def _residuals(axes: Any, course: DayCourse, sets: Sequence[SetCourse], title: str) -> None:
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


def _selected(axes: Any, course: DayCourse, flawed: Sequence[SetCourse]) -> None:
    start = course.config.window_steps
    chosen = course.choice[start:, DAY]
    axes.plot(course.time_h[start:-1], chosen, ".", color="0.2", markersize=2.0)
    for each in flawed:
        axes.axhspan(each.index - 0.5, each.index + 0.5, color="tab:red", alpha=0.12, linewidth=0.0)
    dress(axes, "e) Sets selected by MTD1; shaded: flawed", HOURS, "index", x_limits=(0.0, 24.0))
    axes.set_yticks(range(1, 15))
    axes.set_xticks(range(0, 25, 4))


NAMES = {"none": "no defence", "mtd1": "MTD1", "mtd2": "MTD2"}


def draw_bars(evidence: HvacEvidence, num_sensors: int) -> Any:
    """All four panels."""
    figure = new_figure(11.0, 7.5)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"]])
    line = failing_line(evidence, num_sensors)
    for name, attacker in zip("abc", ATTACKS, strict=True):
        bars = {NAMES[each]: impacts(evidence, num_sensors, attacker, each).tolist() for each in DEFENCES}
        draw_impacts(panels[name], bars, f"{name}) {attacker} attack")
        panels[name].axhline(line, **REFERENCE)
    sets = {
        NAMES[each]: [float(bar.distinct_sets.mean()) for bar in outcomes(evidence, num_sensors, "random", each)]
        for each in DEFENCES[1:]
    }
    draw_counts(panels["d"], sets, "d) Sensor sets selected, random attack", "sets", shades(len(DEFENCES))[1:])
    number = {4: "4.7", 8: "4.8"}[num_sensors]
    figure.suptitle(
        f"Fig. {number} recomputed ({num_sensors} sensors); dashed: attack-free without a defence, {line:.1f} °C²"
    )
    return figure
