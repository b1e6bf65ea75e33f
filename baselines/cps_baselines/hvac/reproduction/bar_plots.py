"""Bars of impacts and of numbers of sets by the number of attacked sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cps_baselines.reproduction.figures import dress, shades

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
