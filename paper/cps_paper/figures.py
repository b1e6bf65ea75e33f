"""What the figures of all chapters share, drawn from our simulations; matplotlib comes with an extra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cps_envs.core.errors import require

PURPOSE = "drawing the figures of the paper"
GRID = {"color": "0.88", "linewidth": 0.6}
MARKERS = "osD^v"  # of the curves of one panel, beside `shades`
SMALL = 8  # letters of a legend


def new_figure(width_in: float, height_in: float, title: str = "") -> Any:
    """A matplotlib figure without panels that needs no display.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    figures = require("matplotlib.figure", extra="baselines", purpose=PURPOSE)
    figure = figures.Figure(figsize=(width_in, height_in), layout="constrained")
    figure.suptitle(title)
    return figure


def require_matplotlib() -> None:
    """Fail before hours of work, not after.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require("matplotlib.figure", extra="baselines", purpose=PURPOSE)


def dress(
    axes: Any,
    title: str,
    x: str,
    y: str,
    *,
    x_limits: Sequence[float] = (),
    y_limits: Sequence[float] = (),
    legend: Mapping[str, Any] | None = None,
) -> None:
    """Title, axis labels with units, a quiet grid, limits (one: the lower), and with `legend` (its place) a legend."""
    axes.set_title(title, fontsize=10, loc="left")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(**GRID)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if x_limits:
        axes.set_xlim(*x_limits)
    if y_limits:
        axes.set_ylim(*y_limits)
    if legend is not None:
        add_legend(axes, **legend)


def add_legend(axes: Any, *curves: Any, thick: bool = False, **where: Any) -> None:
    """A quiet one; `thick` lines show the colours of thin ones. `curves` and their names come from other panels."""
    legend = axes.legend(*curves, fontsize=SMALL, title_fontsize=SMALL, frameon=False, **where)
    for line in legend.get_lines() if thick else ():
        line.set_linewidth(2.0)


def curves(
    axes: Any, x: Any, values: Any, names: Sequence[str | None], colors: Sequence[Any] = (), **style: Any
) -> None:
    """A curve over x (K,) for each column of `values` (K, m), by default in `shades`."""
    for column, name, color in zip(values.T, names, colors or shades(len(names)), strict=True):
        axes.plot(x, column, color=color, label=name, **style)


def marked_curves(axes: Any, x: Sequence[float], rows: Mapping[str, Sequence[float]]) -> None:
    """Few points (K,) by name, each marked, over their places x (K,)."""
    for (name, values), color, marker in zip(rows.items(), shades(len(rows)), MARKERS, strict=True):
        axes.plot(x, values, color=color, marker=marker, markersize=4, label=name)
    axes.set_xticks(x)


def shades(count: int, first: float = 0.0, last: float = 0.88) -> list[Any]:
    """Colours in an order that also shows in grey."""
    maps = require("matplotlib", extra="baselines", purpose=PURPOSE)
    scale = maps.colormaps["viridis"]
    return [scale(first + (last - first) * i / max(count - 1, 1)) for i in range(count)]
