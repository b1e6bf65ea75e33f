"""Heat maps of a benchmark: the darker a cell, the more damage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.benchmark.matrix import Entry, Grid, every_entry, grids
from cps_agents.benchmark.suite import Outcome
from cps_agents.files import replacing
from cps_agents.heatmap import draw_matrix
from cps_envs import find_problem

DPI = 150


def draw_heat_maps(outcome: Outcome, folder: Path) -> list[Path]:
    """One PNG per table; returns their paths."""
    top = max((entry.value for entry in every_entry(outcome)), default=1.0)
    paths = []
    for grid in grids(outcome):
        path = folder / f"{find_problem(outcome.benchmark.problem).name}-{grid.name}.png"
        figure = _draw(grid, top)
        with replacing(path) as draft:
            figure.savefig(draft, dpi=DPI)
        paths.append(path)
    return paths


def _draw(grid: Grid, top: float) -> Any:
    """The same colours in all figures: 0 to `top`."""
    rows = [row for _, row in grid.rows]
    return draw_matrix(
        np.array([[entry.value for entry in row] for row in rows]),
        [[_text(entry) for entry in row] for row in rows],
        [heading for heading, _ in grid.rows],
        grid.columns,
        title=f"{grid.title}\n{grid.legend}",
        axis=grid.axis,
        limits=(0.0, max(top, 1e-9)),
    )


def _text(entry: Entry) -> str:
    return entry.text + (f"\npaper {entry.paper.value:.2f}" if entry.paper else "")
