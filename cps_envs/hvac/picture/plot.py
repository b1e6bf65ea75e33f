"""A small diagram: panel, grid, numbers on the right, and where a value lies in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cps_envs.core.picture.canvas import Box, Canvas, Point
from cps_envs.core.picture.palette import BORDER, GRID, MUTED, PANEL, Color
from cps_envs.core.types import FloatArray

AXIS = 36  # pixels at the right for the numbers
SMALL = 15
SPACING = 16  # pixels between numbers
ROOM = 4  # pixels between the range of values and the edges of the panel


@dataclass(frozen=True)
class Plot:
    """A panel that shows values from `low` to `high`; a logarithmic one shows those of their logarithms to base 10."""

    box: Box
    low: float
    high: float
    logarithmic: bool = False

    def points(self, x: FloatArray, values: FloatArray) -> list[Point]:
        """Pixels of values (k,) that lie at `x` (k,); of those out of range, at the nearest end."""
        _, top, _, height = self.box
        if self.logarithmic:
            values = np.log10(np.maximum(values, 10.0**self.low))
        share = (np.clip(values, self.low, self.high) - self.low) / (self.high - self.low)
        y = top + height - ROOM - share * (height - 2 * ROOM)
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def y(self, value: float) -> float:
        """Height in pixels of a value."""
        return self.points(np.zeros(1), np.array([value]))[0][1]

    def marks(self) -> list[float]:
        """Round values in the range, or powers of ten, as many as there is space for."""
        count = min(max(self.box[3] // SPACING, 1), 4)
        span = (self.high - self.low) / count
        step = float(math.ceil(span)) if self.logarithmic else rounded_up(span, (1, 2, 5))
        steps = range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1)
        return [10.0**k if self.logarithmic else step * k for k in steps]


def rounded_up(value: float, steps: Sequence[float] = (1, 1.5, 2, 3, 5, 7)) -> float:
    """The next of some steps times a power of ten, so that axes seldom change."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (*steps, 10) if step * power >= value - 1e-9)


def draw_panel(canvas: Canvas, plot: Plot, title: str) -> float:
    """The panel with a grid and numbers, and a line above it; returns where that line ends."""
    left, top, width, _ = plot.box
    canvas.box(plot.box, PANEL)
    for mark in plot.marks():
        y = plot.y(mark)
        canvas.box((left, round(y), width, 1), GRID)
        canvas.text(f"{mark:g}", (left + width + 7, y), MUTED, SMALL)
    return left + canvas.text(title, (left, top - 7), MUTED, SMALL)


def draw_level(canvas: Canvas, plot: Plot, value: float, color: Color) -> None:
    """A dashed line across the panel."""
    left, _, width, _ = plot.box
    canvas.dashes((left, round(plot.y(value)), width, 1), color, period=8, length=4)


def draw_curve(canvas: Canvas, points: list[Point], color: Color) -> None:
    """A line two pixels thick."""
    if len(points) > 1:
        canvas.path(points, color)
        canvas.path([(x, y + 1) for x, y in points], color)


def draw_dots(canvas: Canvas, points: list[Point], color: Color) -> None:
    """Small dots, for values that jump."""
    for x, y in points:
        canvas.box((x - 1, y - 1, 2, 2), color)


def draw_edge(canvas: Canvas, plot: Plot) -> None:
    """The border of the panel, over what it holds."""
    canvas.box(plot.box, BORDER, border=1)
