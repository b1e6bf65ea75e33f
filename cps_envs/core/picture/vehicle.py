"""Vehicles on a road, seen from above."""

from __future__ import annotations

from cps_envs.core.picture.canvas import OVERSAMPLING, Box, Canvas, Point, legible
from cps_envs.core.picture.palette import Color, darker

ASPHALT: Color = (58, 64, 74)
SHOULDER: Color = (84, 91, 102)
MARKING: Color = (176, 183, 193)

VEHICLE_M = 4.5  # drawn length of vehicles that are points in a model; gaps are drawn between bumpers
DASH_PERIOD_M = 12.0
SHAPE = 0.42  # width of a vehicle over its length
SHORTEST_GLAZED = 10  # pixels of length from which windows are drawn
BURST = 20  # pixels of the mark of a collision


def draw_lane(canvas: Canvas, lane: Box, scale: float, begin_m: float, thick: int) -> None:
    """Asphalt whose markings stay on the road, and so run backwards under the vehicles.

    It begins at `begin_m` and is drawn at `scale` pixels per metre; the markings are `thick` pixels.
    """
    left, top, width, height = lane
    canvas.box(lane, ASPHALT, radius=2)
    canvas.box((left, top + 1, width, 1), SHOULDER)
    period, line = legible(DASH_PERIOD_M * scale), (left, top + height - 1 - thick, width, thick)
    canvas.dashes(line, MARKING, period=period, length=period / 3, phase=-begin_m * scale)


def draw_car(canvas: Canvas, at: Point, size: tuple[int, int], color: Color, rim: Color | None = None) -> None:
    """A vehicle heading right, its upper left corner at a point; its rim is darker unless another colour is given."""
    edge = darker(color) if rim is None else rim

    def paint(large: Canvas) -> None:
        width, height = OVERSAMPLING * size[0], OVERSAMPLING * size[1]
        radius, inset = int(0.3 * height), OVERSAMPLING
        large.box((0, 0, width, height), edge, radius=radius)
        large.box((inset, inset, width - 2 * inset, height - 2 * inset), color, radius=radius - inset // 2)
        if size[0] >= SHORTEST_GLAZED:
            glass = darker(color, 0.35)
            large.box((0.60 * width, 0.16 * height, 0.13 * width, 0.68 * height), glass, radius=3)
            large.box((0.14 * width, 0.2 * height, 0.08 * width, 0.6 * height), glass, radius=3)

    canvas.sprite(("car", size, color, edge), size, at, paint)


def draw_ghost(canvas: Canvas, at: Point, size: tuple[int, int], color: Color) -> None:
    """The outline of a vehicle that is not there, its upper left corner at a point."""

    def paint(large: Canvas) -> None:
        width, height = OVERSAMPLING * size[0], OVERSAMPLING * size[1]
        rim, radius = round(1.6 * OVERSAMPLING), int(0.3 * height)
        large.box((0, 0, width, height), color, radius=radius, border=rim)
        large.box((0.60 * width, 0.2 * height, OVERSAMPLING, 0.6 * height), color)

    canvas.sprite(("ghost", size, color), size, at, paint)


def draw_burst(canvas: Canvas, center: Point, color: Color, rim: Color, size: int = BURST) -> None:
    """The cross that marks a collision, `size` pixels wide."""

    def paint(large: Canvas) -> None:
        end = OVERSAMPLING * size
        large.box((0, 0, end, end), rim, radius=end // 2)
        large.box((0.06 * end, 0.06 * end, 0.88 * end, 0.88 * end), color, radius=end // 2)
        large.cross((0.26 * end, 0.26 * end, 0.48 * end, 0.48 * end), rim, 0.14 * end)

    canvas.sprite(("burst", color, rim, size), (size, size), (center[0] - size / 2, center[1] - size / 2), paint)
