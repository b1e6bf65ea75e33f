"""Fig. 5.2, the swaying platoon, and Fig. 5.4, errors among the circles of the modified sliding mode."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_baselines.reproduction.figures import dress, new_figure, shades
from cps_baselines.rogue.reproduction.circles import followers, radii_m
from cps_baselines.rogue.reproduction.evidence import Evidence, swaying_ride
from cps_baselines.rogue.reproduction.plot_courses import ATTACKER, TIME
from cps_baselines.rogue.reproduction.settings import CIRCLED, DRAWN_HZ, SWAYS, TITLES
from cps_envs.rogue.config import PAPER

CIRCLES = ("n_3", "n_2", "n_1", "1")  # times sigma, from the inside
COLORS = ("tab:blue", "tab:orange")
SPAN_M = 12.0  # that the figure shows of either error


def draw_sways(evidence: Evidence) -> Any:
    """A panel for each of the attackers: where every vehicle is, beside its place on the reference."""
    figure = new_figure(12.0, 5.0)
    panels = figure.subplots(1, len(SWAYS), sharey=True, squeeze=False)[0]
    for panel, attacker in zip(panels, SWAYS, strict=True):
        course = evidence[swaying_ride(attacker)]
        places = course.position_m - course.reference_m[:, np.newaxis]
        for vehicle, color in enumerate(shades(places.shape[1])):
            seized = vehicle == course.attacker
            panel.plot(course.time_s, places[:, vehicle], color=ATTACKER if seized else color, linewidth=1.2)
        for moment in np.flatnonzero(np.diff(course.damage) > 0) + 1:
            pair = int(np.argmax(course.pair_damage[moment] - course.pair_damage[moment - 1]))
            panel.plot(course.time_s[moment], places[moment, pair : pair + 2].mean(), "kx", markersize=8)
        title = "gains of (5.15)" if attacker != SWAYS[-1] else "the sign of k_d reversed"
        dress(panel, f"The attacker (red) after a kick: {title}", TIME, "behind the leader's reference / m")
    figure.suptitle("Fig. 5.2, qualitatively: ten vehicles by (5.15); crosses: contacts of solid bodies")
    return figure


def draw_circles(evidence: Evidence) -> Any:
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
    panel.set_ylim(-SPAN_M, SPAN_M)
    panel.set_aspect("equal")
    panel.legend(fontsize=8, frameon=False, loc="upper right")
    title = f"Fig. 5.4 with errors: {TITLES[CIRCLED]}, {DRAWN_HZ:g} Hz, from alarm to disbanding"
    dress(panel, title, "e / m", "d / (m/s)", x_limits=(-SPAN_M, SPAN_M))
    return figure
