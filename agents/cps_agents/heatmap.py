"""A matrix as a picture in the palette of the viewers and of the report: the darker, the more the attacker is paid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray

CELL_INCHES = (1.15, 0.6)
MARGIN_INCHES = (3.2, 1.7)
DARK = 0.65  # share of the colours from which text is white
LONG = 14  # letters of a column's name that do not fit below it
SLANTED: Mapping[str, Any] = {"rotation": 25, "ha": "right", "rotation_mode": "anchor"}
HEAT = ("#ffffff", "#f9e3cd", "#e39145", "#b8540a", "#6b2d03")  # ever darker
INK, MUTED, GRID = "#1c2430", "#5c6675", "#dde1e7"


def draw_matrix(
    values: FloatArray,
    texts: Sequence[Sequence[str]],
    rows: Sequence[str],
    columns: Sequence[str],
    *,
    title: str,
    axis: str,
    limits: tuple[float, float],
) -> Any:
    """A matplotlib figure of (m, n) values with a text in each entry; colours reach over `limits`.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    figures: Any = require("matplotlib.figure", extra="baselines", purpose="drawing heat maps")
    size = [
        margin + cell * count
        for margin, cell, count in zip(MARGIN_INCHES, CELL_INCHES, values.shape[::-1], strict=True)
    ]
    colors: Any = require("matplotlib.colors", extra="baselines", purpose="drawing heat maps")
    figure = figures.Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    low, high = limits
    image = axes.imshow(
        values, cmap=colors.LinearSegmentedColormap.from_list("heat", HEAT), vmin=low, vmax=high, aspect="auto"
    )
    for i, row in enumerate(texts):
        for j, text in enumerate(row):
            shade = "white" if values[i, j] > low + DARK * (high - low) else INK
            axes.text(j, i, text, ha="center", va="center", fontsize=7, color=shade)
    longest = max(len(line) for column in columns for line in column.split("\n"))
    axes.set_xticks(range(len(columns)), columns, **(SLANTED if longest > LONG else {}))
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xlabel(axis, color=MUTED)
    axes.set_ylabel("attacker", color=MUTED)
    axes.set_title(title, fontsize=9, color=INK)
    for each in (axes, figure.colorbar(image).ax):
        each.tick_params(color=GRID, labelcolor=INK)
        for spine in each.spines.values():
            spine.set_color(GRID)
    return figure
