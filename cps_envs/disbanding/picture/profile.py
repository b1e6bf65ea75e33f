"""The speed of every vehicle along the whole string, over a strip of road seen from far above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_envs.core.picture.canvas import OVERSAMPLING, SMALL, Box, Canvas, Point, legible
from cps_envs.core.picture.marks import LevelLine
from cps_envs.core.picture.palette import BORDER, GRID, MUTED, PANEL, Color
from cps_envs.core.picture.plot import Plot
from cps_envs.core.picture.vehicle import ASPHALT, MARKING
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.picture.convoy import Convoy
from cps_envs.disbanding.picture.palette import DISBANDED, INTACT, JAMMED, UNWARNED, WARNED

AXIS = 40  # pixels at the right for the speed axis
STRIP, NUMBERS = 13, 15  # pixels for the strip of road and for the platoon numbers below it
SIGN_M = 250.0  # distance between the signs beside the road
DASH_M = 50.0
DOT, ROOM = 7, 6  # pixels of a dot, and between the range of speeds and the edges of the plot


def draw_profile(canvas: Canvas, convoy: Convoy, box: Box) -> None:
    """Speed over position in the upper part of a box, the strip and the platoons' numbers below, on one scale."""
    left, top, width, height = box
    wide, high = width - AXIS, height - STRIP - NUMBERS
    plot = Plot((left, top, wide, high), 0.0, convoy.scene.config.max_speed_mps, room=ROOM)
    scale = wide / convoy.road_m
    x = left + wide - convoy.behind_m * scale  # (M,) front bumpers
    draw_axes(canvas, convoy, plot, scale)
    draw_speeds(canvas, convoy, plot.points(x, convoy.scene.speed))
    draw_strip(canvas, convoy, x, (left, top + high, wide, STRIP), scale)
    draw_numbers(canvas, convoy, left + wide, top + height - NUMBERS / 2 + 1, scale)


def draw_axes(canvas: Canvas, convoy: Convoy, plot: Plot, scale: float) -> None:
    """Grid, speed axis, desired speed, and signs that stand beside the road at fixed distances."""
    left, top, width, height = plot.box
    canvas.box(plot.box, PANEL)
    pitch_m = legible(SIGN_M * scale) / scale
    first_m = np.ceil((convoy.end_m - convoy.road_m) / pitch_m) * pitch_m
    for metres in np.arange(first_m, convoy.end_m, pitch_m).tolist():
        x = left + width - (convoy.end_m - metres) * scale
        canvas.box((x, top, 1, height), GRID)
    desired = convoy.scene.config.desired_speed_mps
    for speed in [*np.arange(0.0, max(desired - 4.0, 1.0), 10.0), desired]:
        y = plot.y(speed)
        canvas.box((left, y, width, 1), GRID)
        canvas.text(f"{speed:.0f}", (left + width + 8, y), MUTED, SMALL)
    LevelLine(desired, MUTED)(canvas, plot)
    canvas.box(plot.box, BORDER, border=1)
    canvas.text("m/s", (left + width + 8, top + height + STRIP / 2), MUTED, SMALL)


def draw_speeds(canvas: Canvas, convoy: Convoy, points: Sequence[Point]) -> None:
    """A dot for each vehicle, hollow for human drivers, a cross for those in a collision, joined front to rear."""
    canvas.path(points, MARKING)
    for q, point in enumerate(points):
        draw_dot(canvas, point, convoy.color(q), bool(convoy.human[q]), bool(convoy.scene.collided[q]))


def draw_dot(canvas: Canvas, centre: Point, color: Color, human: bool, collided: bool) -> None:
    """The mark of one vehicle."""

    def paint(large: Canvas) -> None:
        end = OVERSAMPLING * DOT
        if collided:
            large.cross((0, 0, end, end), color, 0.28 * end)
        else:
            large.box((0, 0, end, end), color, radius=end // 2)
        if human and not collided:
            large.box((0.25 * end, 0.25 * end, 0.5 * end, 0.5 * end), PANEL, radius=end // 4)

    at = (centre[0] - DOT / 2, centre[1] - DOT / 2)
    canvas.sprite(("dot", color, human, collided), (DOT, DOT), at, paint)


def draw_strip(canvas: Canvas, convoy: Convoy, x: FloatArray, box: Box, scale: float) -> None:
    """The whole string on its episode, whose markings run backwards under the vehicles."""
    left, top, width, height = box
    canvas.box(box, ASPHALT)
    period = legible(DASH_M * scale)
    phase = -(convoy.end_m - convoy.road_m) * scale
    for y in (top + 1, top + height - 2):
        canvas.dashes((left, y, width, 1), MARKING, period=period, length=period / 2, phase=phase)
    for q in range(len(x)):
        canvas.box((float(x[q]) - 3, top + 3, 3, height - 6), convoy.color(q))
    draw_beliefs(canvas, convoy, x, box)


def draw_beliefs(canvas: Canvas, convoy: Convoy, x: FloatArray, box: Box) -> None:
    """What intact vehicles know, over what is true of them: in the lower half of the strip, and a blocked link."""
    scene, top, height = convoy.scene, box[1], box[3]
    if scene.warned is not None:
        for q in np.flatnonzero(~np.repeat(convoy.disbanded(), scene.config.vehicles_per_platoon)).tolist():
            color = WARNED if scene.warned[q] else UNWARNED
            canvas.box((float(x[q]) - 3, top + height / 2, 3, height / 2 - 3), color)
    if 0 <= scene.jammed_after < len(x) - 1:
        between = (float(x[scene.jammed_after]) + float(x[scene.jammed_after + 1])) / 2
        canvas.box((between - 2, top, 4, height), JAMMED)


def draw_numbers(canvas: Canvas, convoy: Convoy, right: float, y: float, scale: float) -> None:
    """The paper's platoon numbers below the middle of each platoon, left out where they would overlap."""
    free, disbanded = np.inf, convoy.disbanded()
    for platoon, centre in enumerate((right - convoy.spans().mean(axis=1) * scale).tolist()):
        label, color = str(len(disbanded) - platoon), DISBANDED if disbanded[platoon] else INTACT
        width = canvas.text_width(label, color, SMALL)
        if centre + width / 2 < free - 3:
            canvas.text(label, (centre, y), color, SMALL, align=0.5)
            free = centre - width / 2
