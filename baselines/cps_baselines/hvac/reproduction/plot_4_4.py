"""Fig. 4.4: attacks without a defence."""

from __future__ import annotations

from typing import Any

from cps_baselines.hvac.reproduction.bar_plots import draw_impacts
from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.courses import ONSET, REFERENCE, TEMPERATURE, draw_zones, name_zones
from cps_baselines.hvac.reproduction.experiments import ATTACKS, first_zone, undefended
from cps_baselines.reproduction.figures import new_figure

DAY = 0  # the seed that is drawn


def draw(evidence: Evidence) -> Any:
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
