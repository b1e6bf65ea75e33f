"""What stands beside the cards of a picture: a value on a bar, or a scale of colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.palette import BORDER, MUTED, Color

TITLE, BAR, BELOW = 5, 13, 31  # pixels from the top
THICK = 9
LETTERS = 16


@dataclass(frozen=True)
class Gauge:
    """A bar with its title, a value and words below."""

    title: str
    value: str
    color: Color  # of the value
    fills: Sequence[tuple[float, float, Color]]  # from and to which share the bar is filled
    below: Sequence[tuple[str, float]]  # words, and where they stand from 0, the left, to 1, the right
    mark: tuple[float, Color] | None = None  # at a share
    reach: int = 2  # pixels of the mark above and below the bar
    ink: Color = MUTED  # of the words below

    def draw(self, canvas: Canvas, box: Box) -> None:
        """Draw it into a box."""
        left, top, width, _ = box
        canvas.text(self.title, (left, top + TITLE), MUTED, LETTERS)
        canvas.text(self.value, (left + width, top + TITLE), self.color, 18, align=1)
        canvas.box((left, top + BAR, width, THICK), BORDER, radius=2)
        for begin, end, color in self.fills:
            canvas.box((left + width * begin, top + BAR, width * (end - begin), THICK), color, radius=2)
        if self.mark is not None:
            place = left + width * self.mark[0] - 1
            canvas.box((place, top + BAR - self.reach, 2, THICK + 2 * self.reach), self.mark[1])
        for text, share in self.below:
            canvas.text(text, (left + share * width, top + BELOW), self.ink, LETTERS, align=share)


@dataclass(frozen=True)
class Scale:
    """The colours of a quantity, with its values at some shares."""

    title: str
    colors: Sequence[Color]
    values: Sequence[tuple[float, str]]

    def draw(self, canvas: Canvas, box: Box) -> None:
        """Draw it into a box."""
        left, top, width, _ = box
        canvas.text(self.title, (left, top + TITLE), MUTED, LETTERS)
        step = width / len(self.colors)
        for k, color in enumerate(self.colors):
            canvas.box((left + k * step, top + BAR, step, THICK), color)
        for share, text in self.values:
            canvas.text(text, (left + share * width, top + BELOW), MUTED, LETTERS, align=share)
