"""What vehicles act on that is not what their sensors would honestly say: ghosts of the vehicles ahead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cps_envs.core.picture.canvas import SMALL, Box, Canvas
from cps_envs.core.picture.palette import BELIEVED, FALSE, PAGE, Color
from cps_envs.core.picture.vehicle import draw_ghost
from cps_envs.fdi.picture.scene import Scene

LABEL_ROOM = 6  # pixels between a label and what is beside it
HIGHEST_ROW, GHOST = 24.0, 15  # pixels of a row of beliefs, and of an outline in it
ARROW = 8  # pixels of the tip of a line that goes on outside the road


@dataclass(frozen=True)
class SensorBelief:
    """The gap and closing speed that a vehicle acts on; a ghost where its range is falsified or replaced."""

    begin: float  # pixels: its front bumper
    end: float  # where it believes the rear end of what is ahead
    label: str
    color: Color
    ghost: bool


def belief_color(scene: Scene, vehicle: int) -> Color | None:
    """Of a vehicle, counted from 0: falsified, replaced by the defender, or neither."""
    sensors = [vehicle, len(scene.gap) + vehicle]
    if (scene.attacked & scene.trusted)[sensors].any():
        return FALSE
    return BELIEVED if not scene.trusted[sensors].all() else None


def beliefs_of(scene: Scene, front: Sequence[float], scale: float) -> list[SensorBelief]:
    """The beliefs of vehicles whose front bumpers are at `front` (n,) in pixels; none before the first step."""
    n, found = len(scene.gap), []
    special = scene.attacked | ~scene.trusted
    if scene.time_s == 0 and not scene.metrics["illegal"]:
        return []
    for i in range(n):
        color, parts = belief_color(scene, i), []
        if color is None:
            continue
        if special[i]:
            parts.append(f"{scene.used_gap[i]:.1f} m")
        if special[n + i]:
            parts.append(f"{scene.used_closing_speed[i]:+.1f} m/s")
        gap = scene.used_gap[i] if special[i] else scene.gap[i]
        found.append(SensorBelief(front[i], front[i] + scale * float(gap), ", ".join(parts), color, bool(special[i])))
    return found


def draw_beliefs(canvas: Canvas, beliefs: Sequence[SensorBelief], box: Box, length: int) -> None:
    """Rows from the bottom of a box, on the episode, upwards; `length` is that of a vehicle in pixels."""
    left, top, width, height = box
    spans = [span_of(canvas, belief, left + width, length) for belief in beliefs]
    rows = free_rows(spans)
    pitch = min(HIGHEST_ROW, height / (1 + max(rows, default=0)))
    for belief, row in zip(beliefs, rows, strict=True):
        y = top + height - (row + 0.5) * pitch
        canvas.box((belief.begin - 1, y, 2, top + height - y), belief.color)
        draw_line(canvas, belief, y, left + width)
        if belief.ghost and belief.end + length < left + width:
            size = (length, min(round(pitch) - 3, GHOST))
            draw_ghost(canvas, (belief.end, y - size[1] / 2), size, belief.color)
        draw_label(canvas, belief, y, left + width, length)


def draw_line(canvas: Canvas, belief: SensorBelief, y: float, right: float) -> None:
    """The believed gap, with a tip where it goes on outside the road."""
    stop = min(belief.end, right - ARROW)
    begin, end = sorted((belief.begin, stop))
    canvas.box((begin, y - 1, end - begin, 2), belief.color)
    if belief.end > right:
        canvas.polygon([(right - ARROW - 1, y - 5), (right - ARROW - 1, y + 5), (right - 1, y)], belief.color)
    elif not belief.ghost:
        canvas.box((belief.end - 2, y - 4, 2, 9), belief.color)


def draw_label(canvas: Canvas, belief: SensorBelief, y: float, right: float, length: int) -> None:
    """The believed numbers: on the line, or where they do not fit beside it."""
    room = label_width(canvas, belief)
    if fits(belief, right, room):
        middle = (belief.begin + min(belief.end, right)) / 2
        canvas.box((middle - room / 2, y - 6, room, 12), PAGE)
        canvas.text(belief.label, (middle, y + 1), belief.color, SMALL, align=0.5)
        return
    _, end = span_of(canvas, belief, right, length)
    align = 1.0 if end < right else 0.0
    x = end - LABEL_ROOM / 2 if end < right else belief.begin - LABEL_ROOM - room
    canvas.text(belief.label, (x, y + 1), belief.color, SMALL, align=align)


def span_of(canvas: Canvas, belief: SensorBelief, right: float, length: int) -> tuple[float, float]:
    """What a belief takes of its row, in pixels, the label included."""
    room = label_width(canvas, belief)
    begin, end = sorted((belief.begin, belief.end + belief.ghost * length))
    if fits(belief, right, room):
        return begin, min(end, right)
    return (begin, end + room) if end + room < right else (begin - room - LABEL_ROOM, right)


def label_width(canvas: Canvas, belief: SensorBelief) -> float:
    """Of the numbers with some room around."""
    return canvas.text_width(belief.label, belief.color, SMALL) + LABEL_ROOM


def fits(belief: SensorBelief, right: float, room: float) -> bool:
    """Whether a label finds room on the visible part of the line."""
    return min(belief.end, right) - belief.begin > room + 2 * ARROW


def free_rows(spans: Sequence[tuple[float, float]]) -> list[int]:
    """The lowest row for each of several intervals, in which it meets no earlier one."""
    rows: list[int] = []
    taken: list[list[tuple[float, float]]] = []
    for begin, end in spans:
        free = (all(end + 4 < a or b + 4 < begin for a, b in row) for row in taken)
        row = next((place for place, is_free in enumerate(free) if is_free), len(taken))
        if row == len(taken):
            taken.append([])
        taken[row].append((begin, end))
        rows.append(row)
    return rows
