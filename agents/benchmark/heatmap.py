"""Heat maps of a benchmark: the darker a cell, the more damage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from agents.benchmark.matrix import Grid, every_entry, grids
from agents.benchmark.runner import Outcome
from agents.files import replacing
from cps_envs.core.errors import require

CELL_INCHES = (1.15, 0.6)


def draw_heat_maps(outcome: Outcome, folder: Path) -> list[Path]:
    """One PNG per table; returns their paths."""
    figures: Any = require("matplotlib.figure", extra="baselines", purpose="drawing heat maps")
    top = max((entry.value for entry in every_entry(outcome)), default=1.0)
    paths = []
    for grid in grids(outcome):
        path = folder / f"{outcome.benchmark.problem}-{grid.name}.png"
        figure = _draw(figures, grid, top)
        with replacing(path) as draft:
            figure.savefig(draft, dpi=150)
        paths.append(path)
    return paths


def _draw(figures: Any, grid: Grid, top: float) -> Any:
    """The same colours in all figures: 0 to `top`."""
    rows = [row for _, row in grid.rows]
    values = np.array([[entry.value for entry in row] for row in rows])
    size = (3.2 + CELL_INCHES[0] * values.shape[1], 1.7 + CELL_INCHES[1] * values.shape[0])
    figure = figures.Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    image = axes.imshow(values, cmap="YlOrRd", vmin=0.0, vmax=max(top, 1e-9), aspect="auto")
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            printed = f"\npaper {entry.paper.value:.2f}" if entry.paper else ""
            shade = "white" if entry.value > 0.7 * top else "black"
            axes.text(j, i, entry.text + printed, ha="center", va="center", fontsize=7, color=shade)
    axes.set_xticks(range(len(grid.columns)), grid.columns)
    axes.set_yticks(range(len(rows)), [heading for heading, _ in grid.rows])
    axes.set_xlabel(grid.axis)
    axes.set_ylabel("attacker")
    axes.set_title(f"{grid.title}\n{grid.legend}", fontsize=9)
    figure.colorbar(image)
    return figure
