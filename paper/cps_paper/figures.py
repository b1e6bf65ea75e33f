"""What the figures of all chapters share, drawn from our simulations; matplotlib comes with an extra."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cps_envs.core.errors import require

PURPOSE = "drawing the figures of the paper"
GRID = {"color": "0.88", "linewidth": 0.6}
MARKERS = "osD^v"  # of the curves of one panel, beside `shades`


def new_figure(width_in: float, height_in: float) -> Any:
    """An empty matplotlib figure that needs no display.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    figures = require("matplotlib.figure", extra="baselines", purpose=PURPOSE)
    return figures.Figure(figsize=(width_in, height_in), layout="constrained")


def require_matplotlib() -> None:
    """Fail before hours of work, not after.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require("matplotlib.figure", extra="baselines", purpose=PURPOSE)


def dress(axes: Any, title: str, x: str, y: str, *, x_limits: Sequence[float] | None = None) -> None:
    """Title, axis labels with units, a quiet grid."""
    axes.set_title(title, fontsize=10, loc="left")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(**GRID)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if x_limits is not None:
        axes.set_xlim(*x_limits)


def shades(count: int, first: float = 0.0, last: float = 0.88) -> list[Any]:
    """Colours in an order that also shows in grey."""
    maps = require("matplotlib", extra="baselines", purpose=PURPOSE)
    scale = maps.colormaps["viridis"]
    return [scale(first + (last - first) * i / max(count - 1, 1)) for i in range(count)]
