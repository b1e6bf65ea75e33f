"""What a panel shows, as data: lines, curves, areas, dots and bars, each of which is drawn when it is called."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cps_envs.core.picture.canvas import SMALL, Canvas
from cps_envs.core.picture.palette import MUTED, Color, tint
from cps_envs.core.picture.plot import Plot
from cps_envs.core.types import FloatArray

Mark: TypeAlias = Callable[[Canvas, Plot], None]
WIDE_BAR = 25  # pixels, from which on numbers of neighbours do not meet
TIP = 5  # pixels of the arrow of a bar that goes on outside the panel
TIME_MARKS = 5


def decimal(value: float, places: int = 1, sign: str = "") -> str:
    """A number with so many decimal places, without a minus before zero; with `sign` "+" also with a plus."""
    return f"{round(value, places) + 0.0:{sign}.{places}f}"


@dataclass(frozen=True)
class LevelLine:
    """A line across the panel at a value, dashed if that is in range, or solid."""

    value: float
    color: Color
    solid: bool = False

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw it."""
        left, _, width, _ = plot.box
        line = (left, round(plot.y(self.value)), width, 1)
        if self.solid:
            canvas.box(line, self.color)
        elif plot.shows(self.value):
            canvas.dashes(line, self.color, period=8, length=4)


@dataclass(frozen=True)
class Event:
    """What happened at a share of the episode: an upright line, and a mark on the header's bar."""

    share: float
    color: Color

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw it."""
        canvas.box((round(float(plot.along(self.share))), plot.box[1], 1, plot.box[3]), self.color)


@dataclass(frozen=True)
class Line:
    """A line through values (k,) at shares (k,) of the width, two pixels thick unless thin; nothing for one value."""

    share: FloatArray
    values: FloatArray
    color: Color
    thin: bool = False

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw it."""
        points = plot.points(plot.along(self.share), self.values)
        if len(points) > 1:
            canvas.path(points, self.color)
            if not self.thin:
                canvas.path([(x, y + 1) for x, y in points], self.color)


@dataclass(frozen=True)
class Area:
    """What lies between a curve and another one, or a level, at shares (k,) of the width; nothing for one value."""

    share: FloatArray
    high: FloatArray
    low: FloatArray | float
    color: Color

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw it."""
        x = plot.along(self.share)
        if len(x) > 1:
            ends = x if np.ndim(self.low) else x[[0, -1]]
            bottom = plot.points(ends, np.broadcast_to(self.low, ends.shape))
            canvas.polygon([*plot.points(x, self.high), *bottom[::-1]], self.color)


@dataclass(frozen=True)
class Dots:
    """Small squares of `size` pixels at values (k,), for those that jump."""

    share: FloatArray
    values: FloatArray
    color: Color
    size: int = 2

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw them."""
        for x, y in plot.points(plot.along(self.share), self.values):
            canvas.box((x - 1, y - 1, self.size, self.size), self.color)


@dataclass(frozen=True)
class Disc:
    """A disc at one value, such as the present one of a curve."""

    share: float
    value: float
    color: Color
    radius: float = 3.5

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw it."""
        canvas.circle((float(plot.along(self.share)), plot.y(self.value)), self.radius, self.color)


@dataclass(frozen=True)
class Bar:
    """A bar from zero to a value, with an arrow where that is out of the panel, from `left` on."""

    left: float  # pixels
    width: float  # pixels
    value: float
    color: Color
    hollow: bool = False

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw it."""
        end, zero = sorted((round(plot.y(self.value)), round(plot.y(0.0))))
        box = (round(self.left), end, round(self.width), max(zero - end, 2))
        canvas.box(box, tint(self.color, 0.22) if self.hollow else self.color)
        if self.hollow:
            canvas.box(box, self.color, border=1)
        if not plot.shows(self.value):
            x, up = self.left + self.width / 2, self.value > plot.high
            tip = plot.box[1] + 1 if up else plot.box[1] + plot.box[3] - 2
            back = tip + TIP + 1 if up else tip - TIP - 1
            canvas.polygon([(x - TIP, back), (x + TIP, back), (x, tip)], self.color)


@dataclass(frozen=True)
class BarValue:
    """The value of a bar at its end, inside the panel."""

    bar: Bar
    color: Color

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw it."""
        value, (_, top, _, height) = self.bar.value, plot.box
        y = plot.y(value) + (-7 if value >= 0 else 8)
        if value < 0 and y > top + height - 7:
            y = plot.y(0.0) - 7
        elif not plot.shows(value):
            y += 16 if value > 0 else -16
        at = (self.bar.left + self.bar.width / 2, min(max(y, top + 7), top + height - 7))
        canvas.text(decimal(value), at, self.color, SMALL, align=0.5)


@dataclass(frozen=True)
class TimeLabels:
    """Times below a panel, each with its share of the width, `below` pixels from it."""

    times: Sequence[tuple[float, str]]
    below: int = 9

    def __call__(self, canvas: Canvas, plot: Plot) -> None:
        """Draw them."""
        y = plot.box[1] + plot.box[3] + self.below
        for share, label in self.times:
            canvas.text(label, (float(plot.along(share)), y), MUTED, SMALL, align=share)


def seconds(duration_s: float) -> TimeLabels:
    """Seconds below a panel that an episode fills."""
    return TimeLabels([(share, f"{share * duration_s:g} s") for share in np.linspace(0.0, 1.0, TIME_MARKS).tolist()])
