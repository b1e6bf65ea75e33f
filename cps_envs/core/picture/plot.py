"""A small diagram: panel, grid, numbers on the right, where a value lies in it, and curves over an episode's time."""

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
TIME_MARKS = 5


@dataclass(frozen=True)
class Plot:
    """A panel that shows values from `low` to `high`; a logarithmic one those from 10^low to 10^high."""

    box: Box
    low: float
    high: float
    logarithmic: bool = False

    def y(self, value: float) -> float:
        """Height in pixels of a value; of one out of range, the nearest end."""
        return self.points(np.zeros(1), np.array([value]))[0][1]

    def points(self, x: FloatArray, values: FloatArray) -> list[Point]:
        """Pixels of values (k,) that lie at `x` (k,); of those out of range, at the nearest end."""
        _, top, _, height = self.box
        if self.logarithmic:
            values = np.log10(np.maximum(values, 10.0**self.low))
        share = (np.clip(values, self.low, self.high) - self.low) / (self.high - self.low)
        y = top + height - ROOM - share * (height - 2 * ROOM)
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def shows(self, value: float) -> bool:
        """Whether a value is in range."""
        if self.logarithmic:
            return bool(10.0**self.low <= value <= 10.0**self.high)
        return self.low <= value <= self.high

    def marks(self) -> list[float]:
        """Round values in the range, or powers of ten, as many as there is space for."""
        count = min(max(int(self.box[3] // SPACING), 1), 4)
        span = (self.high - self.low) / count
        step = float(math.ceil(span)) if self.logarithmic else rounded_up(span, (1, 2, 5))
        steps = range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1)
        return [10.0 ** (step * k) if self.logarithmic else step * k for k in steps]

    def along(self, share: FloatArray | float) -> FloatArray:
        """Pixels from the left of shares of the width; those above 1 lie at its end."""
        left, _, width, _ = self.box
        return np.asarray(left + ROOM + np.minimum(share, 1.0) * (width - 2 * ROOM))


def rounded_up(value: float, steps: Sequence[float] = (1, 1.5, 2, 3, 5, 7)) -> float:
    """The next of some steps times a power of ten, so that axes seldom change."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (*steps, 10) if step * power >= value - 1e-9)


def draw_panel(canvas: Canvas, plot: Plot, bands: Sequence[tuple[Box, Color]] = ()) -> None:
    """The panel with coloured bands, a grid and numbers."""
    left, _, width, _ = plot.box
    canvas.box(plot.box, PANEL)
    for box, color in bands:
        canvas.box(box, color)
    for mark in plot.marks():
        canvas.box((left, round(plot.y(mark)), width, 1), BORDER if mark == 0 else GRID)
        canvas.text(f"{mark:g}", (left + width + 7, plot.y(mark)), MUTED, SMALL)


def draw_title(canvas: Canvas, plot: Plot, title: str) -> float:
    """A line above the panel; returns where it ends."""
    left, top, _, _ = plot.box
    return left + canvas.text(title, (left, top - 7), MUTED, SMALL)


def draw_level(canvas: Canvas, plot: Plot, value: float, color: Color) -> None:
    """A dashed line across the panel, if the value is in range."""
    left, _, width, _ = plot.box
    if plot.shows(value):
        canvas.dashes((left, round(plot.y(value)), width, 1), color, period=8, length=4)


def draw_edge(canvas: Canvas, plot: Plot) -> None:
    """The border of the panel, over what it holds."""
    canvas.box(plot.box, BORDER, border=1)


def draw_curve(canvas: Canvas, points: list[Point], color: Color) -> None:
    """A line two pixels thick; nothing for fewer than two points."""
    if len(points) > 1:
        canvas.path(points, color)
        canvas.path([(x, y + 1) for x, y in points], color)


def draw_dots(canvas: Canvas, points: list[Point], color: Color) -> None:
    """Small dots, for values that jump."""
    for x, y in points:
        canvas.box((x - 1, y - 1, 2, 2), color)


def draw_times(canvas: Canvas, plot: Plot, duration_s: float) -> None:
    """Seconds below a panel that `along` fills with an episode."""
    _, top, _, height = plot.box
    for share in np.linspace(0.0, 1.0, TIME_MARKS).tolist():
        at = (float(plot.along(share)), top + height + 9)
        canvas.text(f"{share * duration_s:g} s", at, MUTED, SMALL, align=share)
