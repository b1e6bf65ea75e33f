"""What stands around the road and the panels of a picture, declared: header, cards with numbers, caption, legend."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from cps_envs.core.picture.canvas import SMALL, Box, Canvas, Point
from cps_envs.core.picture.gauge import Gauge, Scale
from cps_envs.core.picture.marks import Event
from cps_envs.core.picture.palette import BORDER, INK, MUTED, PAGE, PANEL, WHITE, Color

WIDTH, HEIGHT, MARGIN = 960, 540, 16
INNER = WIDTH - 2 * MARGIN
BAR: Box = (MARGIN, 38, INNER, 5)  # the progress of the episode
CARDS: Box = (MARGIN, 52, INNER, 38)
CAPTION = 104.0  # height in pixels


@dataclass(frozen=True)
class LegendEntry:
    """A word of the legend, and what stands before it: a square of a colour, or what is drawn at a point."""

    label: str
    symbol: Color | Callable[[Canvas, Point], None]
    width: int = 15  # pixels from the point to the word
    space: int = 14  # pixels before the point

    def draw(self, canvas: Canvas, right: float, y: float) -> float:
        """Draw it so that it ends at `right`; returns where the next one ends."""
        right -= canvas.text_width(self.label, INK, SMALL)
        canvas.text(self.label, (right, y), INK, SMALL)
        right -= self.width
        if callable(self.symbol):
            self.symbol(canvas, (right, y))
        else:
            canvas.box((right, y - 5, 10, 10), self.symbol, radius=2)
        return right - self.space


@dataclass(frozen=True)
class Frame:
    """What is said of a moment of an episode."""

    title: str
    subtitle: str
    time: tuple[str, str]  # now, and at the end of the episode
    progress: float  # share of the episode
    cards: Sequence[tuple[str, str]]  # labels with their values
    pitch: float  # pixels from card to card
    events: Sequence[Event] = ()
    gauge: Gauge | Scale | None = None  # in what the cards leave free
    caption: str = ""
    badge: Color | None = None  # behind the caption
    legend: Sequence[LegendEntry] = ()
    caption_y: float = CAPTION

    def draw(self, canvas: Canvas) -> None:
        """Begin a picture with it."""
        canvas.fill(PAGE)
        self._draw_header(canvas)
        self._draw_cards(canvas)
        right = float(WIDTH - MARGIN)
        for entry in reversed(self.legend):
            right = entry.draw(canvas, right, self.caption_y)
        self._draw_caption(canvas)

    def _draw_header(self, canvas: Canvas) -> None:
        now, end = self.time
        width = canvas.text(f" / {end}", (WIDTH - MARGIN, 24), MUTED, 18, align=1)
        width += canvas.text(now, (WIDTH - MARGIN - width, 22), INK, 28, align=1)
        begin = MARGIN + canvas.text(self.title, (MARGIN, 22), INK, 28) + 14
        with canvas.within((0, 0, WIDTH - MARGIN - width - 14, HEIGHT)):
            canvas.text(self.subtitle, (begin, 24), MUTED, 18)
        canvas.box(BAR, BORDER, radius=2)
        if self.progress > 0:
            canvas.box((MARGIN, BAR[1], INNER * min(self.progress, 1.0), BAR[3]), MUTED, radius=2)
        for event in self.events:
            left = MARGIN + INNER * min(event.share, 1.0) - 1
            canvas.box((left, BAR[1] - 2, 3, BAR[3] + 4), event.color, radius=1)

    def _draw_cards(self, canvas: Canvas) -> None:
        left, top, width, height = CARDS
        for k, (label, value) in enumerate(self.cards):
            card = (left + k * self.pitch, top, self.pitch - 8, height)
            canvas.box(card, PANEL, radius=4)
            canvas.box(card, BORDER, radius=4, border=1)
            canvas.text(label, (card[0] + 9, top + 11), MUTED, 16)
            canvas.text(value, (card[0] + 9, top + 27), INK, 22)
        if self.gauge is not None:
            begin = len(self.cards) * self.pitch + 8
            self.gauge.draw(canvas, (left + begin, top, width - begin, height))

    def _draw_caption(self, canvas: Canvas) -> None:
        y = self.caption_y
        if self.badge is not None:
            canvas.box((MARGIN, y - 9, canvas.text_width(self.caption, WHITE, 17) + 16, 18), self.badge, radius=4)
            canvas.text(self.caption, (MARGIN + 8, y), WHITE, 17)
        elif self.caption:
            canvas.text(self.caption, (MARGIN, y), MUTED, 16)
