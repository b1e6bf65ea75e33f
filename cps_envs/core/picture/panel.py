"""A small diagram, declared: its title, its ranges and what it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cps_envs.core.picture.canvas import SMALL, Box, Canvas
from cps_envs.core.picture.frame import INNER, MARGIN
from cps_envs.core.picture.marks import Mark
from cps_envs.core.picture.palette import BORDER, GRID, MUTED, PANEL, Color
from cps_envs.core.picture.plot import AXIS, Plot

GUTTER = 16  # pixels between two columns of panels


@dataclass(frozen=True)
class Panel:
    """A panel with a grid, numbers at the right, and marks, drawn in their order."""

    plot: Plot
    title: str
    marks: Sequence[Mark]
    words: Sequence[tuple[str, Color]] = ()  # that go on with the title, as far as they fit
    note: tuple[str, Color] | None = None  # above the right end
    bands: Sequence[tuple[Box, Color]] = ()  # behind the grid
    spacing: int = 9  # pixels before each of the words

    def draw(self, canvas: Canvas) -> None:
        """Draw it where its plot lies."""
        self._draw_ground(canvas)
        self._draw_title(canvas)
        for mark in self.marks:
            mark(canvas, self.plot)
        canvas.box(self.plot.box, BORDER, border=1)

    def _draw_ground(self, canvas: Canvas) -> None:
        left, _, width, _ = self.plot.box
        canvas.box(self.plot.box, PANEL)
        for box, color in self.bands:
            canvas.box(box, color)
        for value in self.plot.marks():
            y = self.plot.y(value)
            canvas.box((left, round(y), width, 1), BORDER if value == 0 else GRID)
            canvas.text(f"{value:g}", (left + width + 7, y), MUTED, SMALL)

    def _draw_title(self, canvas: Canvas) -> None:
        left, top, width, _ = self.plot.box
        end, y = left + canvas.text(self.title, (left, top - 7), MUTED, SMALL), top - 7
        for text, color in self.words:
            if end + canvas.text_width(text, color, SMALL) < left + width:
                end += self.spacing + canvas.text(text, (end + self.spacing, y), color, SMALL)
        if self.note is not None:
            canvas.text(self.note[0], (left + width, y), self.note[1], SMALL, align=1)


def side_by_side(top: float, height: float, pitch: float, rows: int = 3) -> list[list[Box]]:
    """Boxes of the panels on the left and on the right from top to bottom, over the whole width of a picture."""
    width, tops = (INNER - GUTTER) / 2, [top + row * pitch for row in range(rows)]
    lefts = (MARGIN, MARGIN + width + GUTTER)
    return [[(left, top, width - AXIS, height) for top in tops] for left in lefts]
