"""The figures of the chapter, drawn: Figs. 4.2 to 4.8.

They share zones by colour, hours below, the onset, and bars by attacked sensors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cps_envs.core.types import FloatArray
from cps_paper.figures import add_legend, curves, dress, new_figure, shades
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
DAY_H, EVERY_4_H = (0.0, 24.0), range(0, 25, 4)
TEMPERATURE, ERROR = "temperature / °C", "error / °C"
REFERENCE = {"color": "0.3", "linewidth": 0.9, "linestyle": "--"}
ONSET = {"color": "tab:green", "linewidth": 1.0, "linestyle": ":"}
SEED = 0  # of the day that is drawn


def dress_day(axes: Any, title: str, y: str, **limits: Any) -> None:
    """Over the hours of a day."""
    dress(axes, title, HOURS, y, x_limits=DAY_H, **limits)
    axes.set_xticks(EVERY_4_H)


def draw_zones(
    axes: Any, time_h: FloatArray, values: FloatArray, title: str, y: str, style: str = "-", **limits: Any
) -> None:
    """One line per zone; values are (K, n) or one step shorter than `time_h` (K,)."""
    zones = range(1, values.shape[1] + 1)
    names = [f"zone {zone}" if style == "-" else None for zone in zones]
    curves(axes, time_h[: len(values)], values, names, linewidth=1.0, linestyle=style)
    dress_day(axes, title, y, **limits)


WIDTH = 0.8  # of a group of bars
LOWEST_C2 = 0.8  # where the axis of impacts begins
HEADROOM = 1.12
Groups = Mapping[str, Sequence[float]]  # by name: a value for 0, 1, 2, ... attacked sensors


def draw_bars(axes: Any, groups: Groups, colors: Sequence[Any], title: str, y: str, **limits: Any) -> None:
    """A bar of each group at each number of attacked sensors."""
    width = WIDTH / len(groups)
    for i, ((name, values), color) in enumerate(zip(groups.items(), colors, strict=True)):
        places = [count - WIDTH / 2 + (i + 0.5) * width for count in range(len(values))]
        axes.bar(places, values, width, color=color, label=name)
    counts = range(max(map(len, groups.values())))
    dress(axes, title, "attacked sensors", y, **limits)
    axes.set_xticks(list(counts), ["none", *map(str, counts[1:])])
    axes.grid(visible=False, axis="x")


def draw_impacts(axes: Any, groups: Groups, title: str) -> None:
    """Impacts, on a logarithmic axis."""
    axes.set_yscale("log")
    shown = {"y_limits": (LOWEST_C2,), "legend": {"loc": "upper left"}}
    draw_bars(axes, groups, shades(len(groups)), title, "A_impact / °C²", **shown)


def draw_clear_day(evidence: HvacEvidence) -> Any:
    """All four panels of Fig. 4.2."""
    course = evidence[noise_free(ENERGIES_W[0])]
    time_h, reference_c = course.time_h, course.config.reference_range_c[0]
    figure = new_figure(11.0, 7.0, "Fig. 4.2 recomputed (attack-free, without noise, E = 1 kW)")
    a, b, c, d = figure.subplot_mosaic("ab;cd").values()
    draw_zones(a, time_h, course.temperature_c[:, 0], "a) Temperatures", TEMPERATURE)
    a.plot(time_h, course.outdoor_c, color="tab:red", linewidth=1.0, label="outside")
    a.axhline(reference_c, label="reference", **REFERENCE)
    add_legend(a, ncols=2)
    draw_zones(b, time_h, course.reading_c[:, 0], "b) Measured, enlarged", TEMPERATURE)
    b.axhline(reference_c, **REFERENCE)
    draw_zones(c, time_h, course.tracking_error_c[:, 0], "c) Absolute tracking errors", ERROR, y_limits=(0.0,))
    draw_zones(d, time_h, course.heating_w[:, 0], "d) Inputs", "heating / W")
    return figure


def draw_energies(evidence: HvacEvidence) -> Any:
    """All four panels of Fig. 4.3."""
    figure = new_figure(11.0, 7.0, "Fig. 4.3 recomputed (attack-free, without noise)")
    *panels, errors = figure.subplot_mosaic("ab;cd").values()
    for name, axes, day, color in zip("abc", panels, energy_days(evidence), shades(len(ENERGIES_W)), strict=True):
        course = evidence[noise_free(day.energy_w)]
        axes.step(course.time_h[:-1], course.level_percent[:, 0, 0], where="post", color=color, linewidth=1.2)
        axes.axhline(1.0, label="1 %, where it settles in the paper", **REFERENCE)
        title = f"{name}) E = {day.energy_w:g} W: on {100.0 * day.on_share:.0f} % of the day"
        dress_day(axes, title, "input of zone 1 / % of E", y_limits=(0.0,), legend={})
        error = course.tracking_error_c[:, 0, 0]
        errors.plot(course.time_h, error, color=color, linewidth=1.2, label=f"{day.energy_w:g} W")
    dress_day(errors, "d) Absolute tracking error of zone 1", ERROR, y_limits=(0.0,), legend={})
    return figure


def draw_undefended(evidence: HvacEvidence) -> Any:
    """All three panels."""
    figure = new_figure(11.0, 7.5, "Fig. 4.4 recomputed; dotted: the attack starts")
    a, b, c = figure.subplot_mosaic("aa;bc").values()
    impacts = {
        attacker: [float(evidence[undefended(attacker, count)].a_impact.mean()) for count in range(5)]
        for attacker in ATTACKS
    }
    draw_impacts(a, impacts, "a) A_impact without a defence; sensors fall in the order 1, 2, 3, 4")
    course = evidence[first_zone("constant")]
    title = f"b) Sensor 1 reads 22 °C: A_impact = {course.a_impact[SEED]:.1f} (paper 149.3)"
    draw_zones(b, course.time_h, course.temperature_c[:, SEED], title, TEMPERATURE)
    b.axhline(course.config.reference_range_c[0], label="reference", **REFERENCE)
    add_legend(b)
    draw_zones(c, course.time_h, course.level_percent[:, SEED], "c) Inputs in the same case", "heating / % of E")
    for axes in (b, c):
        axes.axvline(course.time_h[course.onset_step], **ONSET)
    return figure


LONG, SHORT, TWO, THREE = OBSERVERS
PLACES = {"a": LONG, "b": SHORT, "c": TWO, "d": LONG, "e": SHORT, "f": THREE}


def draw_observers(evidence: HvacEvidence) -> Any:
    """All six panels."""
    figure = new_figure(13.0, 7.0, "Fig. 4.5 recomputed (one day); dotted: the estimation starts")
    panels = figure.subplot_mosaic("abc;def")
    for name, case in PLACES.items():
        course, start = evidence[observed(*case)], case[1]
        axes, hours = panels[name], course.time_h[start:-1]
        if name in "ab":
            title = f"{name}) True, and estimated (dashed): {_said(case)}"
            draw_zones(axes, course.time_h, course.temperature_c[:, SEED], title, TEMPERATURE)
            draw_zones(axes, hours, course.estimate_c[start:, SEED], title, TEMPERATURE, "--")
        else:
            title = f"{name}) Estimation error: {_said(case)}"
            draw_zones(axes, hours, course.estimation_error_c[start:, SEED], title, ERROR, y_limits=(0.0,))
        axes.axvline(course.time_h[start], **ONSET)
    add_legend(panels["a"])
    return figure


def _said(case: Case) -> str:
    sensors, window = case
    return f"{_named(sensors)}, N_e = {window}"


def _named(sensors: Sequence[int]) -> str:
    return ", ".join(f"s{sensor}" for sensor in sensors)


def draw_sets(evidence: HvacEvidence) -> Any:
    """All five panels."""
    course, sets = evidence[second_zone()], set_courses(evidence)
    title = "Fig. 4.6 recomputed (one day, sensor 2 reads 22 °C); dotted: attack and defence start"
    figure = new_figure(13.0, 8.5, title)
    a, b, c, d, e = figure.subplot_mosaic("aaabbb;ccddee").values()
    intact, flawed = [each for each in sets if each.intact], [each for each in sets if not each.intact]
    _residuals(a, course, intact, "a) J of the intact sets")
    _residuals(b, course, flawed, "b) J of the flawed sets")
    shown: dict[str, Any] = {"y_limits": (0.0,), "legend": {}}
    errors_c = course.tracking_error_c[:, SEED]
    draw_zones(c, course.time_h, errors_c, "c) Absolute tracking error under MTD1", ERROR, **shown)
    start = course.config.window_steps
    hours, errors_c = course.time_h[start:-1], course.estimation_error_c[start:, SEED]
    draw_zones(d, hours, errors_c, "d) Absolute estimation error under MTD1", ERROR, **shown)
    _selected(e, course, flawed)
    for axes in (a, b, c, d, e):
        axes.axvline(course.time_h[course.onset_step], **ONSET)
    return figure


def _residuals(axes: Any, course: DayCourse, sets: Sequence[SetCourse], title: str) -> None:
    start, places = course.config.window_steps, [each.index - 1 for each in sets]
    names = [f"{each.index}: {_named(each.sensors)}" for each in sets]
    curves(axes, course.time_h[start:-1], residuals(course)[start:, SEED, places], names, linewidth=0.6)
    axes.set_yscale("log")
    dress_day(axes, title, "J / °C²", y_limits=(1e-4, 1e2), legend={"loc": "upper left", "thick": True})


def _selected(axes: Any, course: DayCourse, flawed: Sequence[SetCourse]) -> None:
    start = course.config.window_steps
    axes.plot(course.time_h[start:-1], course.choice[start:, SEED], ".", color="0.2", markersize=2.0)
    for each in flawed:
        axes.axhspan(each.index - 0.5, each.index + 0.5, color="tab:red", alpha=0.12, linewidth=0.0)
    dress_day(axes, "e) Sets selected by MTD1; shaded: flawed", "index")
    axes.set_yticks(range(1, 15))


NAMES = {"none": "no defence", "mtd1": "MTD1", "mtd2": "MTD2"}
NUMBERS = {4: "4.7", 8: "4.8"}  # of the figure, by number of sensors


def draw_defences(evidence: HvacEvidence, num_sensors: int) -> Any:
    """All four panels of Fig. 4.7 or 4.8."""
    line = failing_line(evidence, num_sensors)
    title = f"Fig. {NUMBERS[num_sensors]} recomputed ({num_sensors} sensors)"
    figure = new_figure(11.0, 7.5, f"{title}; dashed: attack-free without a defence, {line:.1f} °C²")
    panels = figure.subplot_mosaic("ab;cd")
    for name, attacker in zip("abc", ATTACKS, strict=True):
        bars = {NAMES[each]: impacts(evidence, num_sensors, attacker, each).tolist() for each in DEFENCES}
        draw_impacts(panels[name], bars, f"{name}) {attacker} attack")
        panels[name].axhline(line, **REFERENCE)
    sets = {
        NAMES[each]: [float(bar.distinct_sets.mean()) for bar in outcomes(evidence, num_sensors, "random", each)]
        for each in DEFENCES[1:]
    }
    colors, highest = shades(len(DEFENCES))[1:], HEADROOM * max(map(max, sets.values()))
    legend = {"loc": "upper right", "ncols": len(sets)}
    title = "d) Sensor sets selected, random attack"
    draw_bars(panels["d"], sets, colors, title, "sets", y_limits=(0.0, highest), legend=legend)
    return figure
