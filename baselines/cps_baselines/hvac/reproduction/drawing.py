"""What the figures of the chapter share: zones by colour, hours below, the onset, bars by attacked sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cps_baselines.reproduction.figures import dress, shades
from cps_envs.core.types import FloatArray

HOURS = "time / h"
TEMPERATURE, ERROR = "temperature / °C", "error / °C"
REFERENCE = {"color": "0.3", "linewidth": 0.9, "linestyle": "--"}
ONSET = {"color": "tab:green", "linewidth": 1.0, "linestyle": ":"}


def draw_zones(axes: Any, time_h: FloatArray, values: FloatArray, *, title: str, y: str, style: str = "-") -> None:
    """One line per zone; values are (K, n) or one step shorter than `time_h` (K,)."""
    for zone, color in enumerate(shades(values.shape[1]), 1):
        label = f"zone {zone}" if style == "-" else None
        axes.plot(time_h[: len(values)], values[:, zone - 1], style, color=color, linewidth=1.0, label=label)
    dress(axes, title, HOURS, y, x_limits=(0.0, 24.0))
    axes.set_xticks(np.arange(0, 25, 4))


def name_zones(axes: Any, **where: Any) -> None:
    """A quiet legend."""
    axes.legend(fontsize=8, frameon=False, **where)


WIDTH = 0.8  # of a group of bars
LOWEST_C2 = 0.8  # where the axis of impacts begins
HEADROOM = 1.12
Groups = Mapping[str, Sequence[float]]  # by name: a value for 0, 1, 2, ... attacked sensors


def draw_impacts(axes: Any, groups: Groups, title: str) -> None:
    """Impacts, on a logarithmic axis."""
    _draw(axes, groups, shades(len(groups)), title, "A_impact / °C²")
    axes.set_yscale("log")
    axes.set_ylim(LOWEST_C2)
    axes.legend(fontsize=8, frameon=False, loc="upper left")


def draw_counts(axes: Any, groups: Groups, title: str, y: str, colors: Sequence[Any]) -> None:
    """Numbers of something, with room for the legend above."""
    _draw(axes, groups, colors, title, y)
    axes.set_ylim(0.0, HEADROOM * max(map(max, groups.values())))
    axes.legend(fontsize=8, frameon=False, loc="upper right", ncols=len(groups))


def _draw(axes: Any, groups: Groups, colors: Sequence[Any], title: str, y: str) -> None:
    width = WIDTH / len(groups)
    for i, ((name, values), color) in enumerate(zip(groups.items(), colors, strict=True)):
        places = [count - WIDTH / 2 + (i + 0.5) * width for count in range(len(values))]
        axes.bar(places, values, width, color=color, label=name)
    counts = range(max(map(len, groups.values())))
    dress(axes, title, "attacked sensors", y)
    axes.set_xticks(list(counts), ["none", *map(str, counts[1:])])
    axes.grid(visible=False, axis="x")
