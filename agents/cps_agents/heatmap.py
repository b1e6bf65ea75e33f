"""A matrix as a picture: the darker an entry, the more the attacker is paid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray

CELL_INCHES = (1.15, 0.6)
MARGIN_INCHES = (3.2, 1.7)
DARK = 0.7  # share of the colours from which text is white


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
    figure = figures.Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    low, high = limits
    image = axes.imshow(values, cmap="YlOrRd", vmin=low, vmax=high, aspect="auto")
    for i, row in enumerate(texts):
        for j, text in enumerate(row):
            shade = "white" if values[i, j] > low + DARK * (high - low) else "black"
            axes.text(j, i, text, ha="center", va="center", fontsize=7, color=shade)
    axes.set_xticks(range(len(columns)), columns)
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xlabel(axis)
    axes.set_ylabel("attacker")
    axes.set_title(title, fontsize=9)
    figure.colorbar(image)
    return figure
