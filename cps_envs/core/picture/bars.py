"""Bars in a diagram, with their values."""

from __future__ import annotations

from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.palette import Color, tint
from cps_envs.core.picture.plot import SMALL, Plot

TIP = 5  # pixels of the arrow of a bar that goes on outside the panel


def draw_bar(
    canvas: Canvas, plot: Plot, left: float, value: float, color: Color, width: float, *, hollow: bool = False
) -> None:
    """A bar from zero to a value, with an arrow where that is out of the panel."""
    end, zero = sorted((round(plot.y(value)), round(plot.y(0.0))))
    box = (round(left), end, round(width), max(zero - end, 2))
    canvas.box(box, tint(color, 0.22) if hollow else color)
    if hollow:
        canvas.box(box, color, border=1)
    if not plot.shows(value):
        x, up = left + width / 2, value > plot.high
        tip = plot.box[1] + 1 if up else plot.box[1] + plot.box[3] - 2
        back = tip + TIP + 1 if up else tip - TIP - 1
        canvas.polygon([(x - TIP, back), (x + TIP, back), (x, tip)], color)


def draw_value(canvas: Canvas, plot: Plot, x: float, value: float, color: Color) -> None:
    """A number at the end of a bar, inside the panel."""
    _, top, _, height = plot.box
    y = plot.y(value) + (-7 if value >= 0 else 8)
    if value < 0 and y > top + height - 7:
        y = plot.y(0.0) - 7
    elif not plot.shows(value):
        y += 16 if value > 0 else -16
    canvas.text(f"{round(value, 1) + 0.0:.1f}", (x, min(max(y, top + 7), top + height - 7)), color, SMALL, align=0.5)
