"""Figs. 4.2 and 4.3: the attack-free day, and zone 1 with three input energies."""

from __future__ import annotations

from typing import Any

from cps_baselines.hvac.reproduction.clear_day import energy_days
from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.courses import ERROR, HOURS, REFERENCE, TEMPERATURE, draw_zones, name_zones
from cps_baselines.hvac.reproduction.experiments import ENERGIES_W, noise_free
from cps_baselines.reproduction.figures import dress, new_figure, shades


def draw_clear_day(evidence: Evidence) -> Any:
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


def draw_energies(evidence: Evidence) -> Any:
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
