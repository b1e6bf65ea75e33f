"""The picture of the test bed: the circle on the left, speeds and gaps over time on the right."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.frame import INNER, MARGIN, WIDTH, Frame
from cps_envs.core.picture.marks import Event, LevelLine, Line, seconds
from cps_envs.core.picture.palette import DAMAGE, MUTED, tint
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import AXIS, Plot
from cps_envs.core.picture.viewer import CanvasViewer
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.picture.palette import DISBANDED
from cps_paper.testbed.robots.picture.scene import Scene
from cps_paper.testbed.robots.picture.track import Circle, draw_track, shade_of

CARD = (INNER + 8) / 6  # pixels from card to card
CENTER, RADIUS = (230.0, 316.0), 178.0  # of the circle, pixels
LEFT, TOP, HEIGHT, PITCH = 472, 120, 174, 212  # of the panels
WIDEST_M = 1.0  # gap that the panel shows


class RobotViewer(CanvasViewer):
    """The same scene always becomes the same pixels."""

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        frame_of(scene).draw(self._canvas)
        draw_track(self._canvas, scene, Circle(CENTER, RADIUS, scene.config.radius_m))
        for panel in panels(scene):
            panel.draw(self._canvas)


def disbandings(scene: Scene) -> list[Event]:
    """When platoons were disbanded."""
    begun = scene.disbanding_s[np.isfinite(scene.disbanding_s)]
    return [Event(share, DISBANDED) for share in (begun / scene.config.duration_s).tolist()]


def frame_of(scene: Scene) -> Frame:
    """What is shown, the time, the attacks, and the metrics so far."""
    config, metrics = scene.config, scene.metrics
    return Frame(
        title="Test bed",
        subtitle=f"{config.num_robots} robots in {config.num_platoons} platoons on a circle of {config.radius_m:g} m",
        time=(f"{scene.time_s:.1f} s", f"{config.duration_s:g} s"),
        progress=scene.time_s / config.duration_s,
        events=disbandings(scene),
        cards=[
            ("E_v of the intact robots", f"{metrics['velocity_error']:.1f} %"),
            ("Lowest speed of these", f"{metrics['lowest_speed_mps']:.3f} m/s"),
            ("Stopped", f"{metrics['stopped']:.0f}"),
            ("Smallest gap ahead", f"{metrics['smallest_gap_m']:.3f} m"),
            ("Bodies touched", f"{metrics['collided']:.0f}"),
            ("Acceleration, rms", f"{metrics['rms_acceleration_mps2']:.3f} m/s²"),
        ],
        pitch=CARD,
    )


def panels(scene: Scene) -> tuple[Panel, Panel]:
    """Speeds, over the window in which E_v is measured, and gaps ahead, with where bodies touch."""
    config, width = scene.config, WIDTH - MARGIN - AXIS - LEFT
    speed = Plot((LEFT, TOP, width, HEIGHT), 0.0, config.max_speed_mps)
    gap = Plot((LEFT, TOP + PITCH, width, HEIGHT), 0.0, WIDEST_M)
    first, last = config.window
    begin, end = (float(speed.along(period / config.num_periods)) for period in (first, min(last, config.num_periods)))
    window = ((begin, TOP, end - begin, HEIGHT), tint(MUTED, 0.08))
    gaps = np.hstack([np.full((len(scene.gaps), 1), np.inf), scene.gaps])
    begun = disbandings(scene)
    desired, touching = LevelLine(config.desired_speed_mps, MUTED), LevelLine(config.body_length_m, DAMAGE, solid=True)
    return (
        Panel(
            speed,
            "Speeds (m/s); grey: where E_v is measured",
            [desired, *begun, *curves(scene, scene.speeds, speed)],
            bands=[window] if first < config.num_periods else [],
        ),
        Panel(
            gap,
            "Gaps ahead (m), centre to centre;",
            [touching, *begun, *curves(scene, gaps, gap), seconds(config.duration_s)],
            words=[("bodies touch", DAMAGE)],
            spacing=4,
        ),
    )


def curves(scene: Scene, values: FloatArray, plot: Plot) -> list[Line]:
    """A curve for each robot from its values (k, M), rear to front; it ends where it leaves the panel at the top."""
    share, inside = np.arange(len(values)) / scene.config.num_periods, values <= plot.high
    ends = np.where(inside.all(axis=0), len(values), inside.argmin(axis=0)).tolist()
    robots = reversed(range(values.shape[1]))
    return [Line(share[: ends[q]], values[: ends[q], q], shade_of(scene, q)) for q in robots]
