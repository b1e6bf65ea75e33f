"""Figs. 5.6 to 5.11: damage over frequency and power, with the collision line for both readings of its gap."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_baselines.reproduction.figures import PURPOSE, new_figure
from cps_baselines.rogue.reproduction.experiments import Evidence
from cps_baselines.rogue.reproduction.heat_map import HeatMap, bumper_gap_m, collision_frequency_hz
from cps_baselines.rogue.reproduction.settings import CONTACTS, MAPS, PASS, RATIOS, TITLES
from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray
from cps_envs.rogue.config import PAPER

MEANING = {"pass": "vehicles pass through one another", "solid": "solid bodies"}
LINES = (("-", "gap between bumpers"), ("--", "gap between centres, as printed"))
GREEN = "#12a150"
EXPONENT = 0.5  # of the colour scale: low damages show beside the corner's


def draw(evidence: Evidence) -> Any:
    """All six maps of the evidence's contact on one scale."""
    colors = require("matplotlib.colors", extra="baselines", purpose=PURPOSE)
    maps = {figure: evidence.map(defender) for figure, defender in MAPS.items()}
    scale = colors.PowerNorm(EXPONENT, 0.0, max(each.highest for each in maps.values()))
    figure = new_figure(13.0, 7.0)
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
    meaning, selected = MEANING[evidence.contact], "; selected configuration" if evidence.contact == PASS else ""
    figure.suptitle(f"Figs. 5.6 to 5.11 recomputed, contact `{evidence.contact}`: {meaning}{selected}")
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
