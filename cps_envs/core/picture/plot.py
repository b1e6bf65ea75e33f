"""Where values lie in a small diagram."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cps_envs.core.picture.canvas import Box, Point
from cps_envs.core.types import FloatArray

AXIS = 36  # pixels at the right for the numbers
SPACING = 16  # pixels between numbers
ROOM = 4
NARROWEST_BAR, WIDEST_BAR = 4, 28  # pixels


@dataclass(frozen=True)
class Plot:
    """A panel that shows values from `low` to `high`; a logarithmic one those from 10^low to 10^high.

    Its width is a share of the time of an episode, or equal columns, one for each of so many things.
    """

    box: Box
    low: float
    high: float
    logarithmic: bool = False
    columns: int = 1
    room: int = ROOM  # pixels between the range of values and the edges of the panel

    def y(self, value: float) -> float:
        """Height in pixels of a value; of one out of range, the nearest end."""
        return self.points(np.zeros(1), np.array([value]))[0][1]

    def points(self, x: FloatArray, values: FloatArray) -> list[Point]:
        """Pixels of values (k,) that lie at `x` (k,); of those out of range, at the nearest end."""
        _, top, _, height = self.box
        if self.logarithmic:
            values = np.log10(np.maximum(values, 10.0**self.low))
        share = (np.clip(values, self.low, self.high) - self.low) / (self.high - self.low)
        y = top + height - self.room - share * (height - 2 * self.room)
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
        return np.asarray(left + self.room + np.minimum(share, 1.0) * (width - 2 * self.room))

    @property
    def pitch(self) -> float:
        """Pixels from column to column."""
        return self.box[2] / self.columns

    def middle(self, place: int) -> float:
        """Pixels from the left of the middle of a column, counted from 0."""
        return self.box[0] + (place + 0.5) * self.box[2] / self.columns

    def between(self, place: int) -> float:
        """Pixels from the left of the line between a column and the next."""
        return self.middle(place) + self.pitch / 2

    def bar(self, share: float) -> float:
        """Whole pixels of a bar's width that takes a share of its column."""
        return float(np.clip(round(share * self.pitch), NARROWEST_BAR, WIDEST_BAR))

    def column(self, place: int, below: float = 0.0) -> Box:
        """A column, with some pixels below the panel."""
        left, top, _, height = self.box
        return (left + place * self.pitch, top, self.pitch, height + below)


def rounded_up(value: float, steps: Sequence[float] = (1, 1.5, 2, 3, 5, 7)) -> float:
    """The next of some steps times a power of ten, so that axes seldom change."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (*steps, 10) if step * power >= value - 1e-9)
