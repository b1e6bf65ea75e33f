"""The target pair and the injections over the time of the episode."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.canvas import Canvas, Point
from cps_envs.core.picture.palette import INK, MUTED, tint
from cps_envs.core.picture.plot import SMALL, Plot, draw_curve, draw_edge, draw_level, draw_panel, draw_title
from cps_envs.core.types import FloatArray
from cps_envs.fdi.picture.history import (
    BELIEVED_CLOSING,
    BELIEVED_GAP,
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
from cps_envs.fdi.picture.outcome import is_certified
from cps_envs.fdi.picture.palette import DAMAGE, FALSE, FALSES, REPLACED, TRUE
from cps_envs.fdi.picture.scene import Scene


def draw_target_gap(canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray) -> None:
    """The target's gap, true and reported."""
    draw_panel(canvas, plot)
    draw_level(canvas, plot, scene.desired_gap_m, MUTED)
    draw_title(canvas, plot, f"Target gap, {pair_of(scene)}, over time (m)")
    draw_target(canvas, scene, plot, rows, (GAP, REPORTED_GAP, USED_GAP, BELIEVED_GAP), scene.target - 1)


def draw_target_closing_speed(canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray) -> None:
    """The target's closing speed, true and reported, and what is certified about its impact."""
    draw_panel(canvas, plot)
    draw_title(canvas, plot, "Its closing speed over time (m/s)")
    bound = scene.metrics["oracle_bound_mps"]
    if is_certified(scene):
        color = INK if scene.metrics["bound_valid"] else MUTED
        draw_level(canvas, plot, bound, color)
        canvas.text(f"certified {bound:.2f}", (plot.box[0] + plot.box[2], plot.box[1] - 7), color, SMALL, align=1)
    sensor = len(scene.gap) + scene.target - 1
    draw_target(canvas, scene, plot, rows, (CLOSING, REPORTED_CLOSING, USED_CLOSING, BELIEVED_CLOSING), sensor)


def draw_target(
    canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray, columns: tuple[int, int, int, int], sensor: int
) -> None:
    """A curve of the truth, one of what an attacked sensor reported, and marks where the defender replaced that.

    What a filter believes is a pale curve.
    """
    (true, reported, used, believed), duration_s = columns, scene.duration_s
    read = rows[rows[:, TIME] > 0]
    replaced = read[~np.isnan(read[:, used])]
    points = plot.points(plot.along(rows[:, TIME] / duration_s), rows[:, true])
    if scene.attacked[sensor]:
        curve = plot.points(plot.along(read[:, SENSED] / duration_s), read[:, reported])
        draw_curve(canvas, curve, FALSE)
        if curve and not plot.shows(read[-1, reported]):
            draw_outside(canvas, plot, curve[-1], float(read[-1, reported]))
    if not np.isnan(rows[:, believed]).any():
        draw_curve(canvas, plot.points(plot.along(rows[:, TIME] / duration_s), rows[:, believed]), tint(REPLACED, 0.6))
    draw_curve(canvas, points, TRUE)
    for x, y in plot.points(plot.along(replaced[:, SENSED] / duration_s), replaced[:, used]):
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
    waits = scene.time_s < scene.attack_from_s
    end, limit = draw_title(canvas, plot, "Nothing works yet" if waits else "Injected"), plot.box[0] + plot.box[2]
    read, n = rows[rows[:, TIME] > 0], len(scene.gap)
    held_s = np.stack([read[:, SENSED], read[:, SENSED] + step_s], 1).ravel()
    x = plot.along(held_s / scene.duration_s)
    for k, sensor in enumerate(np.flatnonzero(scene.attacked).tolist()):
        color, (name, unit) = FALSES[k % len(FALSES)], name_of(sensor, n)
        values = read[:, INJECTIONS + k]
        draw_curve(canvas, plot.points(x, np.repeat(values, 2)), color)
        label = f"{name} {scene.injection[sensor]:+.4g} {unit}"
        if end + canvas.text_width(label, color, SMALL) < limit:
            end += 10 + canvas.text(label, (end + 10, plot.box[1] - 7), color, SMALL)
    draw_edge(canvas, plot)


def name_of(sensor: int, n: int) -> tuple[str, str]:
    """What a sensor is called, fronts by kind, then rears of vehicles 2..n by kind; and its unit."""
    if sensor < 2 * n:
        return ("x", "v")[sensor // n] + str(sensor % n + 1), ("m", "m/s")[sensor // n]
    kind, place = divmod(sensor - 2 * n, n - 1)
    return ("rx", "rv")[kind] + str(place + 2), ("m", "m/s")[kind]


def pair_of(scene: Scene) -> str:
    """The target and what is ahead of it."""
    ahead = "reference" if scene.target == len(scene.gap) else str(scene.target + 1)
    return f"{scene.target} to {ahead}"
