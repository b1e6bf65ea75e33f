"""The picture of the test bed: the circle on the left, speeds and gaps over time on the right."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.frame import INNER, MARGIN, WIDTH, draw_cards, draw_event, draw_header
from cps_envs.core.picture.palette import PAGE
from cps_envs.core.picture.plot import AXIS, Plot
from cps_envs.core.picture.viewer import CanvasViewer
from cps_envs.disbanding.picture.palette import DISBANDED
from cps_envs.testbed.config import RobotConfig
from cps_envs.testbed.picture.curves import WIDEST_M, draw_gaps, draw_speeds
from cps_envs.testbed.picture.scene import Scene
from cps_envs.testbed.picture.track import Circle, draw_track

CARD = (INNER + 8) / 6  # pixels from card to card
CENTER, RADIUS = (230.0, 316.0), 178.0  # of the circle, pixels
PLOTS_LEFT, PLOTS_TOP, PLOT_HEIGHT, PITCH = 472, 120, 174, 212


class Viewer(CanvasViewer):
    """Draws scenes of one configuration, always the same pixels for the same scene.

    Raises:
        MissingExtraError: no canvas is given, and pygame is not installed.
    """

    def __init__(self, config: RobotConfig, canvas: Canvas | None = None) -> None:
        super().__init__(canvas)
        self._config = config
        self._track = Circle(CENTER, RADIUS, config.radius_m)
        width = WIDTH - MARGIN - AXIS - PLOTS_LEFT
        boxes = [(PLOTS_LEFT, PLOTS_TOP + row * PITCH, width, PLOT_HEIGHT) for row in (0, 1)]
        self._speeds = Plot(boxes[0], 0.0, config.max_speed_mps)
        self._gaps = Plot(boxes[1], 0.0, WIDEST_M)

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        canvas, config = self._canvas, self._config
        canvas.fill(PAGE)
        draw_progress(canvas, scene, config)
        draw_metrics(canvas, scene)
        draw_track(canvas, scene, self._track, config)
        draw_speeds(canvas, scene, self._speeds, config)
        draw_gaps(canvas, scene, self._gaps, config)


def draw_progress(canvas: Canvas, scene: Scene, config: RobotConfig) -> None:
    """What is shown, the time, and the attacks on the bar of the episode's progress."""
    subtitle = f"{config.num_robots} robots in {config.num_platoons} platoons on a circle of {config.radius_m:g} m"
    draw_header(canvas, "Test bed", subtitle, scene.time_s, config.duration_s)
    for time_s in scene.disbanding_s[np.isfinite(scene.disbanding_s)].tolist():
        draw_event(canvas, time_s / config.duration_s, DISBANDED)


def draw_metrics(canvas: Canvas, scene: Scene) -> None:
    """The metrics so far."""
    metrics = scene.metrics
    values = [
        ("E_v of the intact robots", f"{metrics['velocity_error']:.1f} %"),
        ("Lowest speed of these", f"{metrics['lowest_speed_mps']:.3f} m/s"),
        ("Stopped", f"{metrics['stopped']:.0f}"),
        ("Smallest gap ahead", f"{metrics['smallest_gap_m']:.3f} m"),
        ("Bodies touched", f"{metrics['collided']:.0f}"),
        ("Acceleration, rms", f"{metrics['rms_acceleration_mps2']:.3f} m/s²"),
    ]
    draw_cards(canvas, values, (MARGIN, 52, INNER, 38), CARD)
