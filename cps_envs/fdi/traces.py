"""The target pair and the injections over the time of the episode."""

from __future__ import annotations

import numpy as np

from cps_envs.core.canvas import Canvas, Point
from cps_envs.core.palette import INK, MUTED, Color
from cps_envs.core.types import FloatArray
from cps_envs.fdi.history import (
    CLOSING,
    GAP,
    INJECTIONS,
    REPORTED_CLOSING,
    REPORTED_GAP,
    SENSED,
    TIME,
    USED_CLOSING,
    USED_GAP,
)
from cps_envs.fdi.palette import DAMAGE, FALSE, FALSES, REPLACED, TRUE
from cps_envs.fdi.plot import ROOM, SMALL, Plot, draw_edge, draw_level, draw_panel, draw_title
from cps_envs.fdi.scene import Scene

TIME_MARKS = 5


def draw_target_gap(canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray) -> None:
    """The target's gap, true and reported."""
    draw_panel(canvas, plot)
    draw_level(canvas, plot, scene.desired_gap_m, MUTED)
    draw_title(canvas, plot, f"Target gap, {pair_of(scene)}, over time (m)")
    draw_target(canvas, scene, plot, rows, (GAP, REPORTED_GAP, USED_GAP), scene.target - 1)


def draw_target_closing_speed(canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray) -> None:
    """The target's closing speed, true and reported, and what is certified about its impact."""
    draw_panel(canvas, plot)
    draw_title(canvas, plot, "Its closing speed over time (m/s)")
    bound = scene.metrics["oracle_bound_mps"]
    if np.isfinite(bound):
        color = INK if scene.metrics["bound_valid"] else MUTED
        draw_level(canvas, plot, bound, color)
        canvas.text(f"certified {bound:.2f}", (plot.box[0] + plot.box[2], plot.box[1] - 7), color, SMALL, align=1)
    sensor = len(scene.gap) + scene.target - 1
    draw_target(canvas, scene, plot, rows, (CLOSING, REPORTED_CLOSING, USED_CLOSING), sensor)


def draw_target(
    canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray, columns: tuple[int, int, int], sensor: int
) -> None:
    """A curve of the truth, one of what an attacked sensor reported, and marks where the defender replaced that."""
    true, reported, used = columns
    read = rows[rows[:, TIME] > 0]
    replaced = read[~np.isnan(read[:, used])]
    points = plot.points(times(scene, plot, rows[:, TIME]), rows[:, true])
    if scene.attacked[sensor]:
        curve = plot.points(times(scene, plot, read[:, SENSED]), read[:, reported])
        draw_curve(canvas, curve, FALSE)
        if curve and not plot.shows(read[-1, reported]):
            draw_outside(canvas, plot, curve[-1], float(read[-1, reported]))
    draw_curve(canvas, points, TRUE)
    for x, y in plot.points(times(scene, plot, replaced[:, SENSED]), replaced[:, used]):
        canvas.box((x - 1, y - 1, 3, 3), REPLACED)
    collided = bool(scene.metrics["collided_target"])
    canvas.circle(points[-1], 5.0 if collided else 3.5, DAMAGE if collided else TRUE)
    draw_edge(canvas, plot)


def draw_outside(canvas: Canvas, plot: Plot, at: Point, value: float) -> None:
    """A tip where a curve ends out of range, and its value."""
    up = -1 if value > plot.high else 1
    canvas.polygon([(at[0] - 5, at[1]), (at[0] + 5, at[1]), (at[0], at[1] + 6 * up)], FALSE)
    canvas.text(f"{value:.1f}", (at[0], at[1] - 8 * up), FALSE, SMALL, align=0.5)


def draw_injections(canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray, step_s: float) -> None:
    """What is added to each attacked sensor, held for a step; the title names them with their present values."""
    draw_panel(canvas, plot)
    end, limit = draw_title(canvas, plot, "Injected"), plot.box[0] + plot.box[2]
    read, n = rows[rows[:, TIME] > 0], len(scene.gap)
    begin, finish = times(scene, plot, read[:, SENSED]), times(scene, plot, read[:, SENSED] + step_s)
    for k, sensor in enumerate(np.flatnonzero(scene.attacked).tolist()):
        color, unit = FALSES[k % len(FALSES)], "m" if sensor < n else "m/s"
        name = ("x" if sensor < n else "v") + str(sensor % n + 1)
        values = read[:, INJECTIONS + k]
        draw_curve(canvas, plot.points(np.stack([begin, finish], 1).ravel(), np.repeat(values, 2)), color)
        label = f"{name} {scene.injection[sensor]:+.4g} {unit}"
        if end + canvas.text_width(label, color, SMALL) < limit:
            end += 10 + canvas.text(label, (end + 10, plot.box[1] - 7), color, SMALL)
    draw_edge(canvas, plot)


def draw_times(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """Seconds below a panel."""
    _, top, _, height = plot.box
    for second in np.linspace(0.0, scene.duration_s, TIME_MARKS).tolist():
        align = second / scene.duration_s
        x = float(times(scene, plot, np.array(second)))
        canvas.text(f"{second:g} s", (x, top + height + 9), MUTED, SMALL, align=align)


def draw_curve(canvas: Canvas, points: list[Point], color: Color) -> None:
    """A line two pixels thick."""
    if len(points) > 1:
        canvas.path(points, color)
        canvas.path([(x, y + 1) for x, y in points], color)


def times(scene: Scene, plot: Plot, time_s: FloatArray) -> FloatArray:
    """Pixels of times."""
    left, _, width, _ = plot.box
    return np.asarray(left + ROOM + np.minimum(time_s / scene.duration_s, 1.0) * (width - 2 * ROOM))


def pair_of(scene: Scene) -> str:
    """The target and what is ahead of it."""
    ahead = "reference" if scene.target == len(scene.gap) else str(scene.target + 1)
    return f"{scene.target} to {ahead}"
