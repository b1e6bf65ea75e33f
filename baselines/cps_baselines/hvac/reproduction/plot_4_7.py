"""Figs. 4.7 and 4.8: both defences against the three attacks, with four and with eight sensors."""

from __future__ import annotations

from typing import Any

from cps_baselines.hvac.reproduction.bar_plots import draw_counts, draw_impacts
from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.courses import REFERENCE
from cps_baselines.hvac.reproduction.experiments import ATTACKS, DEFENCES
from cps_baselines.hvac.reproduction.impacts import failing_line, impacts, outcomes
from cps_baselines.reproduction.figures import new_figure, shades

NAMES = {"none": "no defence", "mtd1": "MTD1", "mtd2": "MTD2"}


def draw(evidence: Evidence, num_sensors: int) -> Any:
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
