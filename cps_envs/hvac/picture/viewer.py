"""The picture of a heated building under attack: its rooms and sensors, and the course of the day."""

from __future__ import annotations

import math

import numpy as np

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.history import History
from cps_envs.core.picture.palette import BORDER, INK, MUTED, PAGE, PANEL, WHITE
from cps_envs.core.picture.plot import AXIS, Plot, rounded_up
from cps_envs.core.picture.viewer import CanvasViewer
from cps_envs.core.types import FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.picture.belief import EstimateSource, belief_of, clock
from cps_envs.hvac.picture.history import FLAWED_HIGH, INTACT_HIGH, MOST_POINTS, row_of
from cps_envs.hvac.picture.house import House
from cps_envs.hvac.picture.palette import ESTIMATE, FALSE, HONEST, REACH_C, TEMPERATURE_SCALE, TRUE
from cps_envs.hvac.picture.ranking import draw_sets
from cps_envs.hvac.picture.room import draw_disc
from cps_envs.hvac.picture.scene import Scene
from cps_envs.hvac.picture.traces import draw_impact, draw_residuals, draw_temperature
from cps_envs.hvac.sensors import membership

WIDTH, HEIGHT, MARGIN = 960, 540, 16
INNER = WIDTH - 2 * MARGIN
CLOCK = 150  # pixels
HOUSE = (MARGIN, 118, 500, HEIGHT - 118 - MARGIN / 2)
PLOTS_LEFT, PLOTS_TOP = 536, 132
TEMPERATURE, RESIDUALS, IMPACT, SETS, MEMBERS = 104, 70, 42, 54, 42  # pixels of height
TITLE, TIMES = 20, 14
LEGEND = (("true", TRUE), ("controller's estimate", ESTIMATE), ("compromised", FALSE))
CARDS = (("A_impact so far", "a_impact", "{:.2f} C²"), ("Mean error", "mean_abs_error_c", "{:.2f} °C"))
ENERGY = (("Energy", "energy_kwh", "{:.2f} kWh"),)


class Viewer(CanvasViewer):
    """Draws scenes of one configuration; curves hold the frames of the same episode that it has drawn before.

    Raises:
        MissingExtraError: no canvas is given, and pygame is not installed.
    """

    def __init__(self, config: HvacConfig, canvas: Canvas | None = None) -> None:
        super().__init__(canvas)
        self._config = config
        self._member = membership(config)
        self._history = History(MOST_POINTS)
        self._house = House(config, HOUSE)

    def watch(self, scene: Scene) -> None:
        """Take a moment in without drawing it, so that later curves hold it."""
        self._history.add(scene.episode, (scene.step,), row_of(scene, self._member))

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        self.watch(scene)
        canvas, config = self._canvas, self._config
        belief = belief_of(scene, config, self._member)
        canvas.fill(PAGE)
        draw_header(canvas, scene, config)
        draw_cards(canvas, scene, config, (MARGIN, 52, INNER, 38))
        draw_caption(canvas, belief)
        self._house.draw(canvas, scene, belief)
        self._draw_plots(scene)

    def _draw_plots(self, scene: Scene) -> None:
        canvas, config, rows = self._canvas, self._config, self._history.rows()
        temperature, residuals, impact, sets = plots(scene, config, rows)
        draw_temperature(canvas, scene, temperature.box, rows, config)
        draw_residuals(canvas, scene, residuals, rows, config)
        draw_impact(canvas, scene, impact, rows, config)
        draw_sets(canvas, scene, sets, config, self._member, MEMBERS)


def plots(scene: Scene, config: HvacConfig, rows: FloatArray) -> tuple[Plot, Plot, Plot, Plot]:
    """Temperature, residuals over time, impact, and residuals of the sets; both of residuals have the same range."""
    width, top, boxes = WIDTH - MARGIN - AXIS - PLOTS_LEFT, float(PLOTS_TOP), []
    for height, below in ((TEMPERATURE, 0), (RESIDUALS, 0), (IMPACT, TIMES), (SETS, 0)):
        boxes.append((PLOTS_LEFT, top, width, height))
        top += height + TITLE + below
    eps = config.threshold_c2
    known = rows[:, [INTACT_HIGH, FLAWED_HIGH]]
    highest = max(float(np.nan_to_num(known).max()), float(scene.residual.max()), 5 * eps)
    low, high = math.floor(math.log10(eps / 5)), math.ceil(math.log10(highest))
    impact = rounded_up(max(2.0, scene.metrics["a_impact"]))
    return (
        Plot(boxes[0], config.reference_c - 1, config.reference_c + 1),
        Plot(boxes[1], low, high, logarithmic=True),
        Plot(boxes[2], 0.0, impact),
        Plot(boxes[3], low, high, logarithmic=True),
    )


def draw_header(canvas: Canvas, scene: Scene, config: HvacConfig) -> None:
    """What is shown, the time, and a bar of the episode's progress on which the onset is marked."""
    end = MARGIN + canvas.text("HVAC sensor attack", (MARGIN, 22), INK, 28)
    task = f"{scene.compromised.sum()} of {config.num_sensors} sensors compromised"
    task += f", forged from {clock(scene.onset, config)} h on"
    canvas.text(task, (end + 14, 24), MUTED, 18)
    last = config.num_steps - 1
    width = canvas.text(f" / {clock(last, config)} h", (WIDTH - MARGIN, 24), MUTED, 18, align=1)
    canvas.text(clock(scene.step, config), (WIDTH - MARGIN - width, 22), INK, 28, align=1)
    canvas.box((MARGIN, 38, INNER, 5), BORDER, radius=2)
    if scene.step > 0:
        canvas.box((MARGIN, 38, INNER * scene.step / last, 5), MUTED, radius=2)
    canvas.box((MARGIN + INNER * scene.onset / last - 1, 36, 3, 9), FALSE, radius=1)


def draw_cards(canvas: Canvas, scene: Scene, config: HvacConfig, box: Box) -> None:
    """The metrics so far, the weather and the heating, and the colour scale."""
    left, top, width, height = box
    pitch = 138.0
    values = [(label, form.format(scene.metrics[name])) for label, name, form in CARDS]
    values += [("Outside", f"{scene.outdoor_c:.1f} °C"), ("Heating", f"{scene.heating.sum():.0f} W")]
    values += [(label, form.format(scene.metrics[name])) for label, name, form in ENERGY]
    for k, (label, value) in enumerate(values):
        card = (left + k * pitch, top, pitch - 8, height)
        canvas.box(card, PANEL, radius=4)
        canvas.box(card, BORDER, radius=4, border=1)
        canvas.text(label, (card[0] + 9, top + 11), MUTED, 16)
        canvas.text(value, (card[0] + 9, top + 27), INK, 22)
    draw_scale(canvas, config.reference_c, (left + 5 * pitch + 8, top, width - 5 * pitch - 8, height))


def draw_scale(canvas: Canvas, reference_c: float, box: Box) -> None:
    """The colours of the temperatures with their values."""
    left, top, width, _ = box
    canvas.text("True temperature (°C)", (left, top + 5), MUTED, 16)
    for k, color in enumerate(TEMPERATURE_SCALE):
        step = width / len(TEMPERATURE_SCALE)
        canvas.box((left + k * step, top + 13, step, 9), color)
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        value = reference_c + (2 * share - 1) * REACH_C
        canvas.text(f"{value:g}", (left + share * width, top + 31), MUTED, 16, align=share)


def draw_caption(canvas: Canvas, belief: EstimateSource) -> None:
    """What the controller follows, orange if that is compromised; and what the colours mean."""
    y, right = 104.0, float(WIDTH - MARGIN)
    for label, color in reversed(LEGEND):
        right -= canvas.text_width(label, INK, 15)
        canvas.text(label, (right, y), INK, 15)
        right -= 15
        canvas.box((right, y - 5, 10, 10), color, radius=2)
        right -= 14
    for label, full in (("ignored", False), ("followed", True)):
        right -= canvas.text_width(label, INK, 15)
        canvas.text(label, (right, y), INK, 15)
        right -= 11
        draw_disc(canvas, "", (right, y), 5.5, HONEST, full=full)
        right -= 18
    color = FALSE if belief.flawed else ESTIMATE if belief.believed.any() else MUTED
    source = belief.source + (" (forged)" if belief.flawed else "")
    canvas.box((MARGIN, y - 9, canvas.text_width(source, WHITE, 17) + 16, 18), color, radius=4)
    canvas.text(source, (MARGIN + 8, y), WHITE, 17)
