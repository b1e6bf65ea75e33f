"""The picture of a string of platoons: what is paid, the speed profile, and the road itself."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.frame import HEIGHT, INNER, MARGIN, Frame
from cps_envs.core.picture.gauge import Scale
from cps_envs.core.picture.marks import Event
from cps_envs.core.picture.vehicle import VEHICLE_M
from cps_envs.core.picture.viewer import CanvasViewer
from cps_envs.disbanding.picture.convoy import lay_out
from cps_envs.disbanding.picture.palette import DISBANDED, SPEED_SCALE
from cps_envs.disbanding.picture.profile import draw_profile
from cps_envs.disbanding.picture.road import LEGEND, draw_road
from cps_envs.disbanding.picture.scene import Scene

CARD = 150.0  # pixels from card to card
PROFILE_TOP, ROAD_HEIGHT, TALLEST_ROW = 98, 270, 42
CAPTION = f"The same road in rows, with metres from its end; vehicles are drawn {VEHICLE_M} m long, gaps to scale"
BELIEFS = "Strip above, lower half: yellow has a warning, grey has none; magenta is a blocked link. Below: to scale"


class DisbandingViewer(CanvasViewer):
    """The same scene always becomes the same pixels."""

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        canvas, convoy = self._canvas, lay_out(scene)
        road = min(ROAD_HEIGHT, TALLEST_ROW * convoy.rows)
        top = HEIGHT - MARGIN / 2 - road
        frame_of(scene, top - 10).draw(canvas)
        draw_profile(canvas, convoy, (MARGIN, PROFILE_TOP, INNER, top - 24 - PROFILE_TOP))
        draw_road(canvas, convoy, (MARGIN, top, INNER, road))


def frame_of(scene: Scene, caption_y: float) -> Frame:
    """What is shown, the time, the attacks, and the metrics so far."""
    config, metrics, begun = scene.config, scene.metrics, scene.disbanding_s[np.isfinite(scene.disbanding_s)]
    return Frame(
        title="Platoon disbanding",
        subtitle=subtitle(scene),
        time=(f"{scene.time_s:.1f} s", f"{config.duration_s:g} s"),
        progress=scene.time_s / config.duration_s,
        events=[Event(time_s / config.duration_s, DISBANDED) for time_s in begun.tolist()],
        cards=[
            ("Mean speed", f"{scene.speed.mean():.1f} m/s"),
            ("Velocity error, all", f"{metrics['velocity_error_all']:.2f} %"),
            ("Velocity error, intact", f"{metrics['velocity_error_intact']:.2f} %"),
            ("In a collision", f"{metrics['collided']:.0f} of {len(scene.speed)}"),
            ("Stopped, intact", f"{metrics['stopped_share']:.0f} %"),
        ],
        pitch=CARD,
        gauge=scale(config.max_speed_mps),
        caption=CAPTION if scene.warned is None else BELIEFS,
        legend=LEGEND,
        caption_y=caption_y,
    )


def subtitle(scene: Scene) -> str:
    """How many vehicles there are, and which the attacker jolts now."""
    road = f"{len(scene.disbanding_s)} platoons of {scene.config.vehicles_per_platoon} vehicles"
    if scene.config.attack != "jolt":
        return road
    jolted = ", ".join(f"vehicle {vehicle} of platoon {platoon}" for platoon, vehicle in scene.jolted)
    return f"{road}; drivers take over when their ride alarms them; the attacker jolts {jolted or 'nobody'}"


def scale(max_speed_mps: float) -> Scale:
    """The colours of the speeds with their values."""
    speeds = [*np.arange(0.0, max(max_speed_mps - 3.0, 1.0), 10.0).tolist(), max_speed_mps]
    return Scale("Speed (m/s)", SPEED_SCALE, [(speed / max_speed_mps, f"{speed:.0f}") for speed in speeds])
