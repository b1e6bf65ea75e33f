"""Speeds and gaps of the robots over the time of the episode."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.palette import MUTED, tint
from cps_envs.core.picture.plot import (
    SMALL,
    Plot,
    draw_curve,
    draw_edge,
    draw_level,
    draw_panel,
    draw_times,
    draw_title,
)
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.picture.palette import DISBANDED
from cps_envs.testbed.config import RobotConfig
from cps_envs.testbed.picture.palette import CONTACT
from cps_envs.testbed.picture.scene import Scene
from cps_envs.testbed.picture.track import shade_of

WIDEST_M = 1.0  # gap that the panel shows


def draw_speeds(canvas: Canvas, scene: Scene, plot: Plot, config: RobotConfig) -> None:
    """The speed of every robot, over the window in which E_v is measured."""
    first, last = config.window
    ends = [float(plot.along(period / config.num_periods)) for period in (first, min(last, config.num_periods))]
    _, top, _, height = plot.box
    band = ((ends[0], top, ends[1] - ends[0], height), tint(MUTED, 0.08))
    draw_panel(canvas, plot, [band] if first < config.num_periods else [])
    draw_title(canvas, plot, "Speeds (m/s); grey: where E_v is measured")
    draw_level(canvas, plot, config.desired_speed_mps, MUTED)
    draw_disbanding(canvas, scene, plot, config)
    draw_robots(canvas, scene, plot, scene.speeds, config)
    draw_edge(canvas, plot)


def draw_gaps(canvas: Canvas, scene: Scene, plot: Plot, config: RobotConfig) -> None:
    """The gap ahead of every robot, and where bodies touch."""
    draw_panel(canvas, plot)
    end = draw_title(canvas, plot, "Gaps ahead (m), centre to centre;")
    canvas.text("bodies touch", (end + 4, plot.box[1] - 7), CONTACT, SMALL)
    canvas.box((plot.box[0], round(plot.y(config.body_length_m)), plot.box[2], 1), CONTACT)
    draw_disbanding(canvas, scene, plot, config)
    front = np.full((len(scene.gaps), 1), np.inf)
    draw_robots(canvas, scene, plot, np.hstack([front, scene.gaps]), config)
    draw_edge(canvas, plot)
    draw_times(canvas, plot, config.duration_s)


def draw_disbanding(canvas: Canvas, scene: Scene, plot: Plot, config: RobotConfig) -> None:
    """A line at each disbanding."""
    _, top, _, height = plot.box
    for time_s in scene.disbanding_s[np.isfinite(scene.disbanding_s)].tolist():
        canvas.box((float(plot.along(time_s / config.duration_s)), top, 1, height), DISBANDED)


def draw_robots(canvas: Canvas, scene: Scene, plot: Plot, values: FloatArray, config: RobotConfig) -> None:
    """A curve for each robot from its values (k, M), rear to front; it ends where it leaves the panel at the top."""
    x = plot.along(np.arange(len(values)) / config.num_periods)
    for q in reversed(range(values.shape[1])):
        inside = values[:, q] <= plot.high
        end = len(inside) if inside.all() else int(np.argmin(inside))
        draw_curve(canvas, plot.points(x[:end], values[:end, q]), shade_of(scene, q))
