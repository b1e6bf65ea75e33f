"""How the sets of sensors compare now: residuals beside the threshold, who is in each set, and which was chosen."""

from __future__ import annotations

from functools import partial

import numpy as np

from cps_envs.core.picture.canvas import SMALL, Canvas
from cps_envs.core.picture.marks import LevelLine, Mark
from cps_envs.core.picture.palette import BELIEVED, FALSE, GRID, INK, MUTED, TRUE, tint
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import Plot
from cps_envs.hvac.picture.palette import HONEST
from cps_envs.hvac.picture.scene import Scene

BELOW = 42  # pixels for the sensors of the sets
NARROWEST = 5.0  # pixels of a column below which sensors are not told apart
TALLEST_ROW = 10.0  # pixels of a sensor's row
LEAST_ROW, LEAST_PITCH = 8.5, 12.0  # pixels in which a number can be written


def ranking(plot: Plot, scene: Scene) -> Panel:
    """A column for each set: a dot for its mean residual, a line for the newest; below, which sensors it has."""
    metrics, marks = scene.metrics, list[Mark]()
    if 0 < scene.choice <= plot.columns:
        marks.append(partial(draw_choice, scene.choice - 1))
    if scene.ready:
        marks += [LevelLine(scene.config.threshold_c2, INK), partial(draw_values, scene)]
    if plot.pitch >= NARROWEST:
        marks.append(partial(draw_members, scene))
    used = f"{metrics['distinct_sets']:.0f} used, {metrics['flawed_steps']:.0f} steps on flawed ones"
    return Panel(plot, f"{plot.columns} sets now: mean (dot), newest (line)", marks, note=(used, MUTED))


def draw_choice(chosen: int, canvas: Canvas, plot: Plot) -> None:
    """The column of the chosen set."""
    canvas.box(plot.column(chosen, BELOW), tint(BELIEVED, 0.3))


def draw_values(scene: Scene, canvas: Canvas, plot: Plot) -> None:
    """The residuals, in the colours of intact and flawed sets."""
    x = np.array([plot.middle(place) for place in range(plot.columns)])
    means, newest = plot.points(x, scene.mean_residual), plot.points(x, scene.residual)
    reach = max(min(plot.pitch / 2 - 1, 7.0), 1.0)
    dot = min(reach, 3.0)
    for (middle, mean), (_, last), has_lie in zip(means, newest, scene.flawed.tolist(), strict=True):
        color = FALSE if has_lie else TRUE
        canvas.box((middle - reach, last, 2 * reach, 1), tint(color, 0.7))
        canvas.box((middle - dot, mean - 3, 2 * dot, 6), color, radius=3 if dot == 3 else 0)


def draw_members(scene: Scene, canvas: Canvas, plot: Plot) -> None:
    """A row for each sensor, in which its number or a mark stands under every set that it is in."""
    left, top, width, height = plot.box
    pitch, member, sensors = plot.pitch, scene.member, scene.config.num_sensors
    row = min((BELOW - 3) / sensors, TALLEST_ROW)
    written = row >= LEAST_ROW and pitch >= LEAST_PITCH
    mark, thick = min(pitch - 2, 12.0), max(row - 1.5, 1.0)
    for sensor in range(sensors):
        middle = top + height + 3 + (sensor + 0.5) * row
        color = FALSE if scene.compromised[sensor] else HONEST
        if not written:
            canvas.box((left, middle, width, 1), GRID)
        for a in np.flatnonzero(member[:, sensor]).tolist():
            x = plot.middle(a)
            if written:
                canvas.text(str(sensor + 1), (x, middle), color, SMALL, align=0.5)
            else:
                canvas.box((x - mark / 2, middle - thick / 2, mark, thick), color)
