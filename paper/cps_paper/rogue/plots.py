"""The figures of chapter 5: courses (5.3, 5.5), errors (5.2, 5.4), and maps of damage with the collision line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray
from cps_envs.rogue.config import PAPER
from cps_paper.figures import PURPOSE, add_legend, curves, dress, new_figure, shades
from cps_paper.rogue.course import RogueCourse
from cps_paper.rogue.experiments import RogueEvidence, swaying_ride
from cps_paper.rogue.heat_map import (
    CIRCLED,
    CONTACTS,
    COURSE_FREQUENCIES_HZ,
    DRAWN_HZ,
    MAPS,
    PASS,
    RATIOS,
    SWAYS,
    TITLES,
    HeatMap,
    bumper_gap_m,
    collision_frequency_hz,
)
from cps_paper.rogue.rides import followers, radii_m

TIME = "time / s"
ATTACKER = "tab:red"
STYLES = ("-", "--", ":")


def draw(evidence: RogueEvidence, number: str, defenders: Sequence[str]) -> Any:
    """A column of panels per defender; damage for all frequencies, the rest for DRAWN_HZ."""
    title = f"Fig. {number} recomputed: square wave of {DRAWN_HZ:g} Hz, equal power, contact `pass`"
    figure = new_figure(6.4 * len(defenders) + 0.6, 9.0, title)
    panels = figure.subplots(3, len(defenders), sharex=True, sharey="row", squeeze=False)
    for column, defender in zip(panels.T, defenders, strict=True):
        course = evidence.course(defender, DRAWN_HZ)
        _separations(column[0], course, defender)
        _places(column[1], course)
        _damages(column[2], [evidence.course(defender, each) for each in COURSE_FREQUENCIES_HZ])
        for panel in column[:2]:
            _mark_disbanding(panel, course)
    separations, places, damages = panels[:, 0]
    add_legend(separations, ncols=2)
    add_legend(places, ncols=2)
    add_legend(damages, title="attack frequency")
    return figure


def _separations(panel: Any, course: RogueCourse, defender: str) -> None:
    pairs, touching = range(course.separation_m.shape[1]), (course.attacker - 1, course.attacker)
    names = [f"{pair + 1}-{pair + 2}" + " (attacker)" * (pair in touching) for pair in pairs]
    curves(panel, course.time_s, course.separation_m, names, linewidth=1.4)
    panel.set_yscale("symlog", linthresh=20.0)
    lowest_m = min(float(course.separation_m.min()), 0.0)
    panel.axhspan(1.5 * lowest_m, course.config.vehicle_length_m, color="0.9", zorder=0)
    panel.axhline(0.0, color="0.6", linewidth=0.6)
    dress(panel, f"{TITLES[defender]}: separations (grey: overlapping or overtaken)", TIME, "separation / m")


def _places(panel: Any, course: RogueCourse) -> None:
    vehicles = course.position_m.shape[1]
    for vehicle, color in enumerate(shades(vehicles)):
        seized = vehicle == course.attacker
        style = {"color": ATTACKER, "linewidth": 4.0} if seized else {"color": color, "linewidth": 1.4}
        label = f"{vehicle + 1}" + {course.attacker: " (attacker)", vehicles - 1: " (leader)"}.get(vehicle, "")
        panel.plot(course.time_s, -course.behind_m[:, vehicle], label=label, **style)
    panel.axhline(0.0, color="0.6", linewidth=0.6)
    dress(panel, "Positions relative to their places on the reference", TIME, "ahead of the place / m")


def _damages(panel: Any, courses: Sequence[RogueCourse]) -> None:
    for course, frequency_hz, style in zip(courses, COURSE_FREQUENCIES_HZ, STYLES, strict=True):
        panel.plot(course.time_s, course.damage, style, color="0.15", label=f"{frequency_hz:g} Hz")
        _mark_disbanding(panel, course, style)
    panel.set_yscale("symlog", linthresh=10.0)
    x_limits = (0.0, float(np.max(courses[0].time_s)))
    dress(panel, "Total damage (5.8)", TIME, "D / m", x_limits=x_limits, y_limits=(0.0,))


def _mark_disbanding(panel: Any, course: RogueCourse, style: str = "-") -> None:
    if course.disbanded_s is not None:
        panel.axvline(course.disbanded_s, color="tab:orange", linewidth=1.0, linestyle=style)


CIRCLES = ("n_3", "n_2", "n_1", "1")  # times sigma, from the inside
COLORS = ("tab:blue", "tab:orange")
SPAN_M = 12.0  # that the figure shows of either error


def draw_sways(evidence: RogueEvidence) -> Any:
    """A panel for each of the attackers: where every vehicle is, beside its place on the reference."""
    title = "Fig. 5.2, qualitatively: ten vehicles by (5.15); crosses: contacts of solid bodies"
    figure = new_figure(12.0, 5.0, title)
    panels = figure.subplots(1, len(SWAYS), sharey=False, squeeze=False)[0]
    for panel, (attacker, ratio) in zip(panels, SWAYS, strict=True):
        course = evidence[swaying_ride(attacker, ratio)]
        places = course.position_m - course.reference_m[:, np.newaxis]
        colors = shades(places.shape[1])
        colors[course.attacker] = ATTACKER
        curves(panel, course.time_s, places, [None] * len(colors), colors, linewidth=1.2)
        for moment in np.flatnonzero(np.diff(course.damage) > 0) + 1:
            pair = int(np.argmax(course.pair_damage[moment] - course.pair_damage[moment - 1]))
            panel.plot(course.time_s[moment], places[moment, pair : pair + 2].mean(), "kx", markersize=8)
        title = "gains of (5.15)" if attacker != SWAYS[-1][0] else f"k_d reversed, power ratio {ratio:g}"
        dress(panel, f"Attacker (red) after a kick: {title}", TIME, "behind the leader's reference / m")
    return figure


def draw_circles(evidence: RogueEvidence) -> Any:
    """The errors of the vehicles that follow the attacker, the circles (5.13) and the sliding surface."""
    figure = new_figure(7.5, 7.0)
    panel, course = figure.subplots(), evidence.course(CIRCLED, DRAWN_HZ)
    turn = np.linspace(0.0, 2 * np.pi, 200)
    for radius_m, name in zip(radii_m(PAPER), CIRCLES, strict=True):
        panel.plot(radius_m * np.cos(turn), radius_m * np.sin(turn), color="0.6", linewidth=1.0)
        panel.annotate(f"{name} sigma", (0.0, -radius_m), fontsize=8, color="0.4", ha="center", va="top")
    ends = np.array([-SPAN_M, SPAN_M])
    panel.plot(ends, -PAPER.surface_slope_per_s * ends, "--", color="0.2", linewidth=1.0, label="sliding surface s = 0")
    for errors, color in zip(followers(course), COLORS, strict=True):
        label = f"vehicle {errors.vehicle + 1} follows the attacker"
        panel.plot(errors.position_m, errors.speed_mps, color=color, linewidth=1.2, label=label)
    panel.set_aspect("equal")
    title = f"Fig. 5.4 with errors: {TITLES[CIRCLED]}, {DRAWN_HZ:g} Hz, from alarm to disbanding"
    span = (-SPAN_M, SPAN_M)
    dress(panel, title, "e / m", "d / (m/s)", x_limits=span, y_limits=span, legend={"loc": "upper right"})
    return figure


MEANING = {"pass": "vehicles pass through one another", "solid": "solid bodies"}
LINES = (("-", "gap between bumpers"), ("--", "gap between centres, as printed"))
GREEN = "#12a150"
EXPONENT = 0.5  # of the colour scale: low damages show beside the corner's


def draw_maps(evidence: RogueEvidence) -> Any:
    """All six maps of the evidence's contact on one scale."""
    colors = require("matplotlib.colors", extra="baselines", purpose=PURPOSE)
    maps = {figure: evidence.map(defender) for figure, defender in MAPS.items()}
    scale = colors.PowerNorm(EXPONENT, 0.0, max(each.highest for each in maps.values()))
    meaning, selected = MEANING[evidence.contact], "; selected configuration" if evidence.contact == PASS else ""
    title = f"Figs. 5.6 to 5.11 recomputed, contact `{evidence.contact}`: {meaning}{selected}"
    figure = new_figure(13.0, 7.0, title)
    panels = figure.subplots(2, 3, sharex=True, sharey=True)
    for panel, (number, heat_map) in zip(panels.flat, maps.items(), strict=True):
        image = _draw_map(panel, number, heat_map, scale, CONTACTS[evidence.contact])
    for panel in panels[-1]:
        panel.set_xlabel("attack frequency / Hz")
    for panel in panels[:, 0]:
        panel.set_ylabel("attacker's power / others'")
    panels[0, 0].legend(fontsize=8, loc="lower right", title="collision line", title_fontsize=8)
    bar = figure.colorbar(image, ax=panels, shrink=0.8)
    bar.set_label(f"total damage after {PAPER.duration_s:g} s / {CONTACTS[evidence.contact]}")
    return figure


def _draw_map(panel: Any, number: str, heat_map: HeatMap, scale: Any, unit: str) -> Any:
    edges = edges_of(heat_map.frequencies_hz), edges_of(heat_map.ratios)
    image = panel.pcolormesh(*edges, heat_map.damage, norm=scale, cmap="magma_r")
    for gap_m, (style, label) in zip((bumper_gap_m(), PAPER.separation_m), LINES, strict=True):
        ratios = np.linspace(RATIOS[0], edges[1][-1], 60)
        line = [collision_frequency_hz(float(ratio), gap_m) for ratio in ratios]
        panel.plot(line, ratios, style, color=GREEN, linewidth=2.0, label=f"{label}, {gap_m:g} m")
    panel.set_xlim(edges[0][0], edges[0][-1])
    panel.set_ylim(edges[1][0], edges[1][-1])
    text = f"Fig. {number}: {TITLES[MAPS[number]]}\nmaximum {heat_map.highest:.4g}, mean {heat_map.mean:.3g} {unit}"
    panel.set_title(text, fontsize=10, loc="left")
    return image


def edges_of(centres: Any) -> FloatArray:
    """The borders (N + 1,) of cells around evenly spaced centres (N,)."""
    half = (centres[1] - centres[0]) / 2
    return np.append(np.asarray(centres) - half, centres[-1] + half)
