"""Fig. 4.5: the observer with few sensors and short windows."""

from __future__ import annotations

from typing import Any

from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.courses import ERROR, ONSET, TEMPERATURE, draw_zones, name_zones
from cps_baselines.hvac.reproduction.experiments import OBSERVERS, Case, observed
from cps_baselines.reproduction.figures import new_figure

DAY = 0  # the seed that is drawn
LONG, SHORT, TWO, THREE = OBSERVERS
PLACES = {"a": LONG, "b": SHORT, "c": TWO, "d": LONG, "e": SHORT, "f": THREE}


def draw(evidence: Evidence) -> Any:
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
