"""What the pictures of all problems have in common: their size, the header, and cards with numbers."""

from __future__ import annotations

from collections.abc import Sequence

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.palette import BORDER, INK, MUTED, PANEL, Color

WIDTH, HEIGHT, MARGIN = 960, 540, 16
INNER = WIDTH - 2 * MARGIN
BAR: Box = (MARGIN, 38, INNER, 5)  # the progress of the episode


def draw_header(
    canvas: Canvas, title: str, subtitle: str, time_s: float, duration_s: float, *, decimals: int = 1
) -> None:
    """What is shown, the time, and a bar of the episode's progress."""
    width = canvas.text(f" / {duration_s:g} s", (WIDTH - MARGIN, 24), MUTED, 18, align=1)
    width += canvas.text(f"{time_s:.{decimals}f} s", (WIDTH - MARGIN - width, 22), INK, 28, align=1)
    end = MARGIN + canvas.text(title, (MARGIN, 22), INK, 28)
    with canvas.within((0, 0, WIDTH - MARGIN - width - 14, HEIGHT)):
        canvas.text(subtitle, (end + 14, 24), MUTED, 18)
    canvas.box(BAR, BORDER, radius=2)
    share = min(time_s / duration_s, 1.0)
    if share > 0:
        canvas.box((MARGIN, BAR[1], INNER * share, BAR[3]), MUTED, radius=2)


def draw_event(canvas: Canvas, share: float, color: Color) -> None:
    """A mark on the header's bar at a share of the episode."""
    canvas.box((MARGIN + INNER * min(share, 1.0) - 1, BAR[1] - 2, 3, BAR[3] + 4), color, radius=1)


def draw_cards(canvas: Canvas, values: Sequence[tuple[str, str]], box: Box, pitch: float) -> None:
    """Labels with their values on cards from the left of a box on, one every `pitch` pixels."""
    left, top, _, height = box
    for k, (label, value) in enumerate(values):
        card = (left + k * pitch, top, pitch - 8, height)
        canvas.box(card, PANEL, radius=4)
        canvas.box(card, BORDER, radius=4, border=1)
        canvas.text(label, (card[0] + 9, top + 11), MUTED, 16)
        canvas.text(value, (card[0] + 9, top + 27), INK, 22)
