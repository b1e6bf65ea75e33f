"""The road wrapped over several rows with every vehicle on it, front platoon on top, gaps to scale."""

from __future__ import annotations

from functools import partial

import numpy as np

from cps_envs.core.picture.canvas import OVERSAMPLING, SMALL, Box, Canvas, Point
from cps_envs.core.picture.frame import LegendEntry
from cps_envs.core.picture.palette import INK, MUTED, PAGE, WHITE, Color, along
from cps_envs.core.picture.vehicle import ASPHALT, VEHICLE_M, draw_car, draw_lane
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.picture.convoy import Convoy
from cps_envs.disbanding.picture.palette import DISBANDED, INTACT, SPEED_SCALE

CAR_WIDTH_M = 2.1
WIDEST_LANE = 22  # pixels
GUTTER = 40  # pixels at the right for the distance from the end of the road
BRACKET = 11  # pixels above a lane for the platoon's bracket and label
HUMAN_RIM = WHITE
CRUISE = along(SPEED_SCALE, 0.86)  # of the vehicles in the legend
CROSS = 9  # pixels of the mark of a vehicle that was in a collision


def draw_road(canvas: Canvas, convoy: Convoy, box: Box) -> None:
    """All rows, from top to bottom of a box."""
    left, top, width, height = box
    row_height = height / convoy.rows
    for row in range(convoy.rows):
        draw_row(canvas, convoy, row, (left, top + row * row_height, width - GUTTER, row_height))


def draw_row(canvas: Canvas, convoy: Convoy, row: int, box: Box) -> None:
    """One row: lane with markings, brackets over the platoons, vehicles, distance from the end of the road."""
    left, top, width, height = box
    lane = (left, top + BRACKET + 2, width, min(height - BRACKET - 4, WIDEST_LANE))
    scale, begin_m = width / convoy.row_m, row * convoy.row_m
    draw_lane(canvas, lane, scale, convoy.end_m - begin_m - convoy.row_m, thick=1)
    spans = left + width - (convoy.spans() - begin_m) * scale  # (N, 2) from right to left
    for platoon in np.flatnonzero((spans[:, 1] < left + width - 3) & (spans[:, 0] > left + 3)).tolist():
        front, rear = spans[platoon].tolist()
        draw_bracket(canvas, convoy, platoon, (rear, front), (left, top, width, BRACKET))
    with canvas.within(lane):
        draw_vehicles(canvas, convoy, left + width - (convoy.behind_m - begin_m) * scale, scale, lane)
    canvas.text(f"{begin_m:.0f} m", (left + width + GUTTER, lane[1] + lane[3] / 2), MUTED, SMALL, align=1)


def draw_bracket(canvas: Canvas, convoy: Convoy, platoon: int, span: Point, box: Box) -> None:
    """A line over the part of a platoon in a row, with its number, and where its front is when it was disbanded."""
    disbanded, platoons = bool(convoy.disbanded()[platoon]), len(convoy.scene.disbanding_s)
    number, color = str(platoons - platoon), DISBANDED if disbanded else INTACT
    begin, end = max(span[0], box[0]), min(span[1], box[0] + box[2])
    y = box[1] + box[3] / 2 + 1
    canvas.box((begin, y, end - begin, 1), color)
    for tip, here in ((begin, begin == span[0]), (end - 1, end == span[1])):
        if here:
            canvas.box((tip, y, 1, 5), color)
    badge = canvas.text_width(number, WHITE, SMALL) + 8
    if end - begin < badge:
        return
    canvas.box((end - badge, y - 6, badge, 12), color, radius=3)
    canvas.text(number, (end - badge / 2, y + 1), WHITE, SMALL, align=0.5)
    note = f"disbanded at {convoy.scene.disbanding_s[platoon]:.0f} s"
    width = canvas.text_width(note, color, SMALL) + 8
    if disbanded and end == span[1] and end - begin >= badge + width + 4:
        canvas.box((end - badge - width, y - 5, width, 11), PAGE)
        canvas.text(note, (end - badge - 4, y + 1), color, SMALL, align=1)


def draw_vehicles(canvas: Canvas, convoy: Convoy, x: FloatArray, scale: float, lane: Box) -> None:
    """The vehicles whose front bumpers `x` (M,) bring them into a lane; collided ones bear a cross, or are one."""
    left, top, width, height = lane
    size = (max(round(VEHICLE_M * scale), 3), round(min(max(CAR_WIDTH_M * scale, 6), height - 4)))
    middle, large = top + height / 2, size[0] >= 2 * CROSS
    seen = np.flatnonzero((x > left) & (x - size[0] < left + width)).tolist()
    collided = convoy.scene.collided
    for q in seen:
        if large or not collided[q]:
            at = (float(x[q]) - size[0], middle - size[1] / 2)
            draw_car(canvas, at, size, convoy.color(q), HUMAN_RIM if convoy.human[q] else None)
    for q in seen:
        if collided[q]:
            color = WHITE if large else convoy.color(q)
            draw_cross(canvas, (float(x[q]) - size[0] / 2, middle), color)


def draw_cross(canvas: Canvas, centre: Point, color: Color) -> None:
    """The mark of a vehicle that was in a collision."""

    def paint(large: Canvas) -> None:
        end = OVERSAMPLING * CROSS
        large.cross((0, 0, end, end), INK, 0.36 * end)
        large.cross((0.07 * end, 0.07 * end, 0.86 * end, 0.86 * end), color, 0.2 * end)

    canvas.sprite(("cross", color), (CROSS, CROSS), (centre[0] - CROSS / 2, centre[1] - CROSS / 2), paint)


def draw_example(human: bool, collided: bool, canvas: Canvas, at: Point) -> None:
    """A vehicle on a piece of road, for the legend."""
    x, y = at
    canvas.box((x - 2, y - 7, 26, 14), ASPHALT, radius=2)
    draw_car(canvas, (x + 1, y - 4.5), (20, 9), CRUISE, HUMAN_RIM if human else None)
    if collided:
        draw_cross(canvas, (x + 11, y), WHITE)


LEGEND = (
    LegendEntry("intact", partial(draw_example, False, False), width=30, space=16),
    LegendEntry("human driver", partial(draw_example, True, False), width=30, space=16),
    LegendEntry("in a collision", partial(draw_example, False, True), width=30, space=16),
)
