"""Vehicles seen from above."""

from __future__ import annotations

from cps_envs.core.canvas import OVERSAMPLING, Canvas, Point
from cps_envs.core.palette import Color, darker

SHAPE = 0.42  # width of a vehicle over its length
BURST = 20  # pixels of the mark of a collision


def draw_car(canvas: Canvas, at: Point, size: tuple[int, int], color: Color) -> None:
    """A vehicle heading right, its upper left corner at a point."""

    def paint(large: Canvas) -> None:
        width, height = OVERSAMPLING * size[0], OVERSAMPLING * size[1]
        radius, rim = int(0.3 * height), OVERSAMPLING
        large.box((0, 0, width, height), darker(color), radius=radius)
        large.box((rim, rim, width - 2 * rim, height - 2 * rim), color, radius=radius - rim // 2)
        glass = darker(color, 0.38)
        large.box((0.60 * width, 0.16 * height, 0.13 * width, 0.68 * height), glass, radius=int(0.1 * height))
        large.box((0.14 * width, 0.2 * height, 0.08 * width, 0.6 * height), glass, radius=int(0.08 * height))

    canvas.sprite(("car", size, color), size, at, paint)


def draw_ghost(canvas: Canvas, at: Point, size: tuple[int, int], color: Color) -> None:
    """The outline of a vehicle that is not there."""

    def paint(large: Canvas) -> None:
        width, height = OVERSAMPLING * size[0], OVERSAMPLING * size[1]
        rim, radius = round(1.6 * OVERSAMPLING), int(0.3 * height)
        large.box((0, 0, width, height), color, radius=radius, border=rim)
        large.box((0.60 * width, 0.2 * height, OVERSAMPLING, 0.6 * height), color)

    canvas.sprite(("ghost", size, color), size, at, paint)


def draw_burst(canvas: Canvas, center: Point, color: Color, rim: Color) -> None:
    """The cross that marks a collision."""

    def paint(large: Canvas) -> None:
        end = OVERSAMPLING * BURST
        large.box((0, 0, end, end), rim, radius=end // 2)
        large.box((0.06 * end, 0.06 * end, 0.88 * end, 0.88 * end), color, radius=end // 2)
        large.cross((0.26 * end, 0.26 * end, 0.48 * end, 0.48 * end), rim, 0.14 * end)

    canvas.sprite(("burst", color, rim), (BURST, BURST), (center[0] - BURST / 2, center[1] - BURST / 2), paint)
