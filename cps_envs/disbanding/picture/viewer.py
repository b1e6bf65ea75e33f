"""The picture of a string of platoons: what is paid, the speed profile, and the road itself."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.frame import HEIGHT, INNER, MARGIN, WIDTH, draw_cards, draw_event, draw_header
from cps_envs.core.picture.palette import MUTED, PAGE
from cps_envs.core.picture.viewer import CanvasViewer
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.picture.convoy import VEHICLE_M, lay_out
from cps_envs.disbanding.picture.palette import DISBANDED, SPEED_SCALE
from cps_envs.disbanding.picture.profile import draw_profile
from cps_envs.disbanding.picture.road import draw_legend, draw_road
from cps_envs.disbanding.picture.scene import Scene

PITCH = 150.0  # pixels from card to card
ROAD_HEIGHT, TALLEST_ROW = 270, 42
CAPTION = f"The same road in rows, with metres from its end; vehicles are drawn {VEHICLE_M} m long, gaps to scale"
BELIEFS = "Strip above, lower half: yellow has a warning, grey has none; magenta is a blocked link. Below: to scale"
CARDS = (
    ("Velocity error, all", "velocity_error_all", "{:.2f} %"),
    ("Velocity error, intact", "velocity_error_intact", "{:.2f} %"),
    ("In a collision", "collided", "{:.0f} of {vehicles}"),
    ("Stopped, intact", "stopped_share", "{:.0f} %"),
)


class Viewer(CanvasViewer):
    """Draws scenes of one configuration, always the same pixels for the same scene.

    Raises:
        MissingExtraError: no canvas is given, and pygame is not installed.
    """

    def __init__(self, config: DisbandingConfig, canvas: Canvas | None = None) -> None:
        super().__init__(canvas)
        self._config = config

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        canvas, convoy = self._canvas, lay_out(scene, self._config)
        road = min(ROAD_HEIGHT, TALLEST_ROW * convoy.rows)
        canvas.fill(PAGE)
        draw_progress(canvas, scene)
        draw_metrics(canvas, scene, (MARGIN, 52, INNER, 38))
        top = HEIGHT - MARGIN / 2 - road
        draw_profile(canvas, convoy, (MARGIN, 98, INNER, top - 24 - 98), self._config.desired_speed_mps)
        canvas.text(CAPTION if scene.warned is None else BELIEFS, (MARGIN, top - 10), MUTED, 16)
        draw_legend(canvas, WIDTH - MARGIN, top - 10)
        draw_road(canvas, convoy, (MARGIN, top, INNER, road))


def draw_progress(canvas: Canvas, scene: Scene) -> None:
    """What is shown, the time, and the attacks on the bar of the episode's progress."""
    subtitle = f"{len(scene.disbanding_s)} platoons of {scene.vehicles_per_platoon} vehicles"
    draw_header(canvas, "Platoon disbanding", subtitle, scene.time_s, scene.duration_s)
    for time_s in scene.disbanding_s[np.isfinite(scene.disbanding_s)]:
        draw_event(canvas, float(time_s) / scene.duration_s, DISBANDED)


def draw_metrics(canvas: Canvas, scene: Scene, box: Box) -> None:
    """The metrics so far, and the colour scale."""
    left, top, width, height = box
    mean = float(scene.speed.mean())
    values = [("Mean speed", f"{mean:.1f} m/s")]
    values += [(label, form.format(scene.metrics[name], vehicles=len(scene.speed))) for label, name, form in CARDS]
    draw_cards(canvas, values, box, PITCH)
    scale = len(values) * PITCH + 8
    draw_scale(canvas, scene.max_speed_mps, (left + scale, top, width - scale, height))


def draw_scale(canvas: Canvas, max_speed_mps: float, box: Box) -> None:
    """The colours of the speeds with their values."""
    left, top, width, _ = box
    canvas.text("Speed (m/s)", (left, top + 5), MUTED, 16)
    for k, color in enumerate(SPEED_SCALE):
        step = width / len(SPEED_SCALE)
        canvas.box((left + k * step, top + 13, step, 9), color)
    marks = [*np.arange(0.0, max(max_speed_mps - 3.0, 1.0), 10.0), max_speed_mps]
    for speed in marks:
        share = speed / max_speed_mps
        canvas.text(f"{speed:.0f}", (left + share * width, top + 31), MUTED, 16, align=share)
