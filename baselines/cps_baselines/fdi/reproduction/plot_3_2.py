"""Fig. 3.2: separations and relative speeds of ten vehicles whose lead is attacked by Algorithm 2."""

from __future__ import annotations

from typing import Any

from cps_baselines.fdi.reproduction.course import Course, pair_name
from cps_baselines.fdi.reproduction.figure_3_2 import FigureRow
from cps_baselines.reproduction.figures import dress, new_figure, shades
from cps_envs.core.types import FloatArray

TIME = "time / s"
SENSORS = {"x": "range sensor", "xv": "range and range-rate sensors"}
BEHIND = 9  # the pair of the attacked lead with the vehicle behind it, whose collision the paper reports
OURS, BACKGROUND = "tab:red", "tab:blue"


def draw(rows: list[FigureRow]) -> Any:
    """All four panels: a, c for the range sensor, b, d for both sensors."""
    figure = new_figure(11.0, 7.5)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"]])
    for (upper, lower), row in zip((("a", "c"), ("b", "d")), rows, strict=True):
        course, sensors = row.course, SENSORS[row.run.kind]
        _lines(panels[upper], course, course.gap_m)
        dress(panels[upper], f"{upper}) Separations, {sensors} attacked", TIME, "separation / m")
        panels[upper].axhline(0.0, color="0.3", linewidth=0.8)
        panels[upper].axvline(row.paper.time_s, color="0.4", linewidth=1.0, linestyle=":")
        _lines(panels[lower], course, course.relative_speed_mps)
        dress(panels[lower], f"{lower}) Relative speeds: {_said(row)}", TIME, "relative speed / (m/s)")
        panels[lower].plot(row.paper.time_s, row.paper.impact_speed_mps, "x", color="black", label="paper, about")
        for panel in (panels[upper], panels[lower]):
            panel.set_xlim(0.0, 1.05 * max(row.paper.time_s, course.time_s[-1]))
    panels["c"].legend(fontsize=8, frameon=False, loc="upper left")
    figure.suptitle("Fig. 3.2 recomputed (preset fig32: k_p 2, k_d 3, dt 0.05 s, Euler); dotted: the paper's collision")
    return figure


def _lines(axes: Any, course: Course, values: FloatArray) -> None:
    """One line per pair; the pairs of the attacked lead stand out."""
    n = values.shape[1]
    for pair, color in zip(range(1, BEHIND), shades(BEHIND - 1, 0.35, 0.9), strict=True):
        label = "pairs 1-2 to 8-9" if pair == BEHIND - 1 else None
        axes.plot(course.time_s, values[:, pair - 1], color=color, linewidth=0.7, label=label)
    axes.plot(course.time_s, values[:, BEHIND - 1], color=BACKGROUND, linewidth=1.4, label=f"pair {pair_name(BEHIND)}")
    label = f"pair {pair_name(n)} (virtual reference)"
    axes.plot(course.time_s, values[:, n - 1], color=OURS, linewidth=1.4, label=label)


def _said(row: FigureRow) -> str:
    if row.collision is None:
        return "no collision"
    return (
        f"pair {pair_name(row.collision.pair)} at {row.collision.time_s:.2f} s, "
        f"{row.collision.impact_speed_mps:.2f} m/s"
    )
