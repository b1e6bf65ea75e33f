"""The picture of a heated building under attack: its rooms and sensors, and the course of the day."""

from __future__ import annotations

import math
from functools import partial

from cps_envs.core.picture.canvas import Canvas, Point
from cps_envs.core.picture.frame import HEIGHT, MARGIN, WIDTH, Frame, LegendEntry
from cps_envs.core.picture.gauge import Scale
from cps_envs.core.picture.history import Curves
from cps_envs.core.picture.marks import Event
from cps_envs.core.picture.palette import BELIEVED, FALSE, MUTED, TRUE
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import AXIS, Plot, rounded_up
from cps_envs.core.picture.viewer import RememberingViewer
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.picture.belief import EstimateSource, belief_of, clock
from cps_envs.hvac.picture.course import impact, outside, residuals, temperature
from cps_envs.hvac.picture.house import House
from cps_envs.hvac.picture.palette import HONEST, REACH_C, TEMPERATURE_SCALE, middle_c
from cps_envs.hvac.picture.ranking import ranking
from cps_envs.hvac.picture.room import draw_disc
from cps_envs.hvac.picture.scene import Scene
from cps_envs.hvac.powers import COMMANDS, READINGS

CARD = 138.0  # pixels from card to card
HOUSE = (MARGIN, 118, 500, HEIGHT - 118 - MARGIN / 2)
LEFT, TOPS, HEIGHTS = 536, (132, 256, 346, 422), (104, 70, 42, 54)  # of the panels, pixels
WITH_WEATHER = (132, 290, 346, 422), (62, 36, 42, 54)  # the same where the outside is shown too, at
OUTSIDE = 216, 46


class HvacViewer(RememberingViewer):
    """The building on the left, the course of the day on the right."""

    moment = ("step",)
    kept = ("temperature", "reference_c", "estimate", "reading", "ready", "mean_residual", "impact")
    most_points = 240

    def __init__(self, config: HvacConfig, canvas: Canvas | None = None) -> None:
        super().__init__(config, canvas)
        self._house = House(config, HOUSE)

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        self.watch(scene)
        belief = belief_of(scene)
        frame_of(scene, belief).draw(self._canvas)
        self._house.draw(self._canvas, scene, belief)
        for panel in panels(scene, self._history.curves()):
            panel.draw(self._canvas)


def panels(scene: Scene, curves: Curves) -> list[Panel]:
    """Temperature, residuals over time, impact, and residuals of the sets; both of residuals have the same range."""
    width = WIDTH - MARGIN - AXIS - LEFT
    shown = len(scene.day.outdoor_c) > 0
    places = WITH_WEATHER if shown else (TOPS, HEIGHTS)
    boxes = [(LEFT, top, width, height) for top, height in zip(*places, strict=True)]
    weather = [outside((LEFT, OUTSIDE[0], width, OUTSIDE[1]), scene)] if shown else []
    eps, known = scene.config.threshold_c2, curves["mean_residual"][curves["ready"] > 0]
    highest = max(float(known.max(initial=0.0)), float(scene.residual.max()), 5 * eps)
    low, high = math.floor(math.log10(eps / 5)), math.ceil(math.log10(highest))
    return [
        temperature(boxes[0], scene, curves),
        *weather,
        residuals(Plot(boxes[1], low, high, logarithmic=True), scene, curves),
        impact(Plot(boxes[2], 0.0, rounded_up(max(2.0, scene.impact))), scene, curves),
        ranking(Plot(boxes[3], low, high, logarithmic=True, columns=len(scene.member)), scene),
    ]


def frame_of(scene: Scene, belief: EstimateSource) -> Frame:
    """The task, the time and the onset, the metrics so far and the weather, and what the controller follows."""
    config, metrics, last = scene.config, scene.metrics, scene.last_step
    task = f"{scene.compromised.sum()} of {config.num_sensors} sensors compromised"
    followed = BELIEVED if belief.believed.any() else MUTED
    return Frame(
        title="HVAC sensor attack",
        subtitle=f"{task}, forged from {clock(scene.onset, config)} h on",
        time=(clock(scene.step, config), f"{clock(last, config)} h"),
        progress=scene.step / last,
        events=[Event(scene.onset / last, FALSE)],
        cards=[
            ("A_impact so far", f"{scene.impact:.2f} C²"),
            ("Mean error", f"{metrics['mean_abs_error_c']:.2f} °C"),
            ("Outside", f"{scene.outdoor_c:.1f} °C"),
            ("Heating", f"{scene.supplied.sum():.0f} W"),
            ("Energy", f"{metrics['energy_kwh']:.2f} kWh"),
        ],
        pitch=CARD,
        gauge=scale(middle_c(config)),
        caption=belief.source + (" (forged)" if belief.flawed else "") + blocked(scene),
        badge=FALSE if belief.flawed else followed,
        legend=LEGEND,
    )


def blocked(scene: Scene) -> str:
    """Which messages do not arrive, in words."""
    names = [name for name, denied in zip((READINGS, COMMANDS), scene.denied.tolist(), strict=True) if denied]
    return f", no {' or '.join(names)} arrive" if names else ""


def scale(reference_c: float) -> Scale:
    """The colours of the temperatures with their values."""
    shares = (0.0, 0.25, 0.5, 0.75, 1.0)
    values = [(share, f"{reference_c + (2 * share - 1) * REACH_C:g}") for share in shares]
    return Scale("True temperature (°C)", TEMPERATURE_SCALE, values)


def draw_sensor(full: bool, canvas: Canvas, at: Point) -> None:
    """The disc of a sensor that is followed, or the ring of another."""
    draw_disc(canvas, "", at, 5.5, HONEST, full=full)


LEGEND = (
    LegendEntry("followed", partial(draw_sensor, True), width=11, space=18),
    LegendEntry("ignored", partial(draw_sensor, False), width=11, space=18),
    LegendEntry("true", TRUE),
    LegendEntry("controller's estimate", BELIEVED),
    LegendEntry("compromised", FALSE),
)
