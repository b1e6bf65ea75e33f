"""How the sets of sensors compare now: residuals beside the threshold, who is in each set, and which was chosen."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.palette import GRID, INK, MUTED, tint
from cps_envs.core.picture.plot import SMALL, Plot, draw_edge, draw_level, draw_panel, draw_title
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.picture.belief import flawed_sets
from cps_envs.hvac.picture.palette import ESTIMATE, FALSE, HONEST, TRUE
from cps_envs.hvac.picture.scene import Scene

NARROWEST = 5.0  # pixels of a column below which sensors are not told apart
TALLEST_ROW = 10.0  # pixels of a sensor's row
LEAST_ROW, LEAST_PITCH = 8.5, 12.0  # pixels in which a number can be written


def draw_sets(canvas: Canvas, scene: Scene, plot: Plot, config: HvacConfig, member: BoolArray, below: float) -> None:
    """A column for each set: a dot for its mean residual, a line for the newest; below, which sensors it has.

    `below` is the height in pixels for the sensors.
    """
    left, top, width, height = plot.box
    metrics, pitch = scene.metrics, width / len(member)
    draw_panel(canvas, plot)
    draw_title(canvas, plot, f"{len(member)} sets now: mean (dot), newest (line)")
    note = f"{metrics['distinct_sets']:.0f} used, {metrics['flawed_steps']:.0f} steps on flawed ones"
    canvas.text(note, (left + width, top - 7), MUTED, SMALL, align=1)
    if 0 < scene.choice <= len(member):
        x = left + (scene.choice - 1) * pitch
        canvas.box((x, top, pitch, height + below), tint(ESTIMATE, 0.3))
    if scene.ready:
        draw_level(canvas, plot, config.threshold_c2, INK)
        draw_values(canvas, scene, plot, member)
    draw_edge(canvas, plot)
    if pitch >= NARROWEST:
        draw_members(canvas, scene, plot, member, below)


def draw_values(canvas: Canvas, scene: Scene, plot: Plot, member: BoolArray) -> None:
    """The residuals, in the colours of intact and flawed sets."""
    pitch = plot.box[2] / len(member)
    x: FloatArray = plot.box[0] + (np.arange(len(member), dtype=np.float64) + 0.5) * pitch
    means, newest = plot.points(x, scene.mean_residual), plot.points(x, scene.residual)
    reach = max(min(pitch / 2 - 1, 7.0), 1.0)
    dot = min(reach, 3.0)
    flawed = flawed_sets(member, scene.compromised)
    for (middle, mean), (_, last), has_lie in zip(means, newest, flawed.tolist(), strict=True):
        color = FALSE if has_lie else TRUE
        canvas.box((middle - reach, last, 2 * reach, 1), tint(color, 0.7))
        canvas.box((middle - dot, mean - 3, 2 * dot, 6), color, radius=3 if dot == 3 else 0)


def draw_members(canvas: Canvas, scene: Scene, plot: Plot, member: BoolArray, below: float) -> None:
    """A row for each sensor, in which its number or a mark stands under every set that it is in."""
    left, top, width, height = plot.box
    sets, sensors = member.shape
    pitch, row = width / sets, min((below - 3) / sensors, TALLEST_ROW)
    written = row >= LEAST_ROW and pitch >= LEAST_PITCH
    mark, thick = min(pitch - 2, 12.0), max(row - 1.5, 1.0)
    for sensor in range(sensors):
        middle = top + height + 3 + (sensor + 0.5) * row
        color = FALSE if scene.compromised[sensor] else HONEST
        if not written:
            canvas.box((left, middle, width, 1), GRID)
        for a in np.flatnonzero(member[:, sensor]).tolist():
            x = left + (a + 0.5) * pitch
            if written:
                canvas.text(str(sensor + 1), (x, middle), color, SMALL, align=0.5)
            else:
                canvas.box((x - mark / 2, middle - thick / 2, mark, thick), color)
