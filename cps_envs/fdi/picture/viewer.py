"""The picture of a platoon under false data injection: the road, what sensors report, and the course of the episode."""

from __future__ import annotations

import math

import numpy as np

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.frame import INNER, MARGIN, WIDTH, draw_cards, draw_header
from cps_envs.core.picture.palette import BORDER, INK, MUTED, PAGE, WHITE, tint
from cps_envs.core.picture.plot import AXIS, Plot, draw_times, rounded_up
from cps_envs.core.picture.viewer import CanvasViewer
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.picture.history import Peaks, SensorHistory
from cps_envs.fdi.picture.outcome import certificate_of, is_certified, outcome_of, task_of
from cps_envs.fdi.picture.palette import DAMAGE, FALSE, REPLACED, TARGET, TRUE
from cps_envs.fdi.picture.profile import draw_closing_speeds, draw_commands, draw_gaps, draw_numbers
from cps_envs.fdi.picture.road import draw_road
from cps_envs.fdi.picture.scene import Scene
from cps_envs.fdi.picture.traces import draw_injections, draw_target_closing_speed, draw_target_gap

CARD = 138.0  # pixels from card to card
ROAD_TOP, ROAD_HEIGHT = 116, 118
PLOTS_TOP, PLOT_HEIGHT, PITCH = 256, 74, 90
BELOW_ZERO = 0.4  # desired gaps shown below zero, for collisions
HEADROOM = 1.25  # of the axes over the largest values
GUTTER = 16  # pixels between the columns of plots
CAPTION = "Gaps to scale; above the road the gap and closing speed that a vehicle believes"
LEGEND = (("true", TRUE), ("falsified sensor", FALSE), ("replaced by the defender", REPLACED), ("target pair", TARGET))
CARDS = (
    ("Falsified readings", "injected_share", 100.0, "{:.1f} %"),
    ("Replaced readings", "replaced_share", 100.0, "{:.1f} %"),
    ("False alarms", "false_alarm_rate", 100.0, "{:.1f} %"),
)


class Viewer(CanvasViewer):
    """Draws scenes of one configuration; curves hold the moments of the same episode that it has seen before.

    Raises:
        MissingExtraError: no canvas is given, and pygame is not installed.
    """

    def __init__(self, config: FdiConfig, canvas: Canvas | None = None) -> None:
        super().__init__(canvas)
        self._config = config
        self._history = SensorHistory()

    def watch(self, scene: Scene) -> None:
        """Take a moment in without drawing it, so that later curves hold it."""
        self._history.add(with_illegal_readings(scene), self._config.dt_s)

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        self.watch(scene)
        canvas, shown = self._canvas, with_illegal_readings(scene)
        canvas.fill(PAGE)
        draw_header(canvas, "False data injection", task_of(shown), shown.time_s, shown.duration_s, decimals=2)
        draw_metrics(canvas, shown, (MARGIN, 52, INNER, 38))
        draw_caption(canvas, shown, self._config)
        draw_road(canvas, shown, (MARGIN, ROAD_TOP, INNER, ROAD_HEIGHT))
        self._draw_plots(shown)

    def _draw_plots(self, scene: Scene) -> None:
        canvas, config, rows, peaks = self._canvas, self._config, self._history.rows(), self._history.peaks
        (gap, gaps), (speed, speeds), (command, injection) = plots(scene, config, peaks)
        draw_gaps(canvas, scene, gap)
        draw_closing_speeds(canvas, scene, speed)
        draw_commands(canvas, scene, command, config)
        draw_numbers(canvas, scene, command)
        draw_target_gap(canvas, scene, gaps, rows)
        draw_target_closing_speed(canvas, scene, speeds, rows)
        draw_injections(canvas, scene, injection, rows, config.dt_s)
        draw_times(canvas, injection, scene.duration_s)


def with_illegal_readings(scene: Scene) -> Scene:
    """The scene with the readings of an illegal injection, which the vehicles never got to act on."""
    if not scene.metrics["illegal"]:
        return scene
    n = len(scene.gap)
    gap, closing_speed = scene.gap + scene.injection[:n], scene.closing_speed - scene.injection[n:]
    return scene._replace(
        reported_gap=gap,
        reported_closing_speed=closing_speed,
        used_gap=gap,
        used_closing_speed=closing_speed,
        trusted=np.ones_like(scene.trusted),
    )


def plots(scene: Scene, config: FdiConfig, peaks: Peaks) -> list[tuple[Plot, Plot]]:
    """Left and right plot of each row; those of gaps and of closing speeds share their range."""
    gap = (-BELOW_ZERO * scene.desired_gap_m, rounded_up(max(3 * scene.desired_gap_m, HEADROOM * peaks.gap_m)))
    speed = (-rounded_up(HEADROOM * max(5.0, peaks.opening_mps)), rounded_up(HEADROOM * max(8.0, peaks.closing_mps)))
    low, high = config.min_acceleration_mps2, config.max_acceleration_mps2
    if not config.limit_commands:
        high = rounded_up(max(high, peaks.command_mps2))
        low = -high
    injection = rounded_up(max(10 * config.range_resolution_m, peaks.injection))
    ranges = ((gap, gap), (speed, speed), ((HEADROOM * low, HEADROOM * high), (-injection, injection)))
    width = (INNER - GUTTER) / 2
    pairs = []
    for row, (left, right) in enumerate(ranges):
        top = PLOTS_TOP + row * PITCH
        boxes = [(MARGIN + side * (width + GUTTER), top, width - AXIS, PLOT_HEIGHT) for side in (0, 1)]
        pairs.append((Plot(boxes[0], *left), Plot(boxes[1], *right)))
    return pairs


def draw_metrics(canvas: Canvas, scene: Scene, box: Box) -> None:
    """The target and the metrics so far, and the impact speed on its scale."""
    left, top, width, height = box
    i = scene.target - 1
    closing = float(scene.closing_speed[i]) + 0.0  # no minus before zero
    values = [("Target gap", f"{scene.gap[i]:.2f} m"), ("Target closing at", f"{closing:.2f} m/s")]
    values += [(label, form.format(scale * scene.metrics[name])) for label, name, scale, form in CARDS]
    draw_cards(canvas, values, box, CARD)
    begin = len(values) * CARD + 8
    draw_gauge(canvas, scene, (left + begin, top, width - begin, height))


def draw_gauge(canvas: Canvas, scene: Scene, box: Box) -> None:
    """The target's closing speed, then the impact speed, beside what is certified; or how far the errors have grown."""
    left, top, width, _ = box
    if "error_growth_m" in scene.metrics:
        draw_growth(canvas, float(scene.metrics["error_growth_m"]), (left, top, width, 9))
        return
    metrics, closing = scene.metrics, float(scene.closing_speed[scene.target - 1])
    bound, impact, valid = metrics["oracle_bound_mps"], metrics["impact_speed_mps"], bool(metrics["bound_valid"])
    full = rounded_up(max(10.0, impact, closing, bound if math.isfinite(bound) else 0.0))
    bar = (left, top + 13, width, 9)
    canvas.text("Impact speed (m/s)", (left, top + 5), MUTED, 16)
    note = f"{impact:.2f}" if metrics["collided_pairs"] else "none yet"
    canvas.text(note, (left + width, top + 5), DAMAGE if metrics["collided_pairs"] else MUTED, 18, align=1)
    canvas.box(bar, BORDER, radius=2)
    for value, color in ((closing, tint(TRUE, 0.5)), (impact, DAMAGE)):
        if value > 0:
            canvas.box((left, bar[1], width * value / full, bar[3]), color, radius=2)
    color = INK if valid else MUTED
    if is_certified(scene):
        canvas.box((left + width * bound / full - 1, bar[1] - 3, 2, bar[3] + 6), color)
    canvas.text(certificate_of(scene), (left, top + 31), color, 16)


def draw_growth(canvas: Canvas, growth_m: float, box: Box) -> None:
    """What the errors have grown, for an attacker who is after instability."""
    left, top, width, height = box
    canvas.text("Errors have grown by (m)", (left, top + 5), MUTED, 16)
    canvas.text(f"{growth_m:.2f}", (left + width, top + 5), DAMAGE if growth_m > 0 else MUTED, 18, align=1)
    canvas.box((left, top + 13, width, height), BORDER, radius=2)
    if growth_m > 0:
        canvas.box((left, top + 13, width * growth_m / rounded_up(max(10.0, growth_m)), height), DAMAGE, radius=2)
    canvas.text("nothing certified for this goal", (left, top + 31), MUTED, 16)


def draw_caption(canvas: Canvas, scene: Scene, config: FdiConfig) -> None:
    """How the road is drawn, or how the episode ended; and what the colours mean."""
    y, right = 104.0, float(WIDTH - MARGIN)
    for label, color in reversed(LEGEND):
        right -= canvas.text_width(label, INK, 15)
        canvas.text(label, (right, y), INK, 15)
        right -= 15
        canvas.box((right, y - 5, 10, 10), color, radius=2)
        right -= 14
    outcome = outcome_of(scene, config)
    if not outcome:
        canvas.text(CAPTION, (MARGIN, y), MUTED, 16)
        return
    color = DAMAGE if scene.metrics["collided_pairs"] or scene.metrics["illegal"] else MUTED
    canvas.box((MARGIN, y - 9, canvas.text_width(outcome, WHITE, 17) + 16, 18), color, radius=4)
    canvas.text(outcome, (MARGIN + 8, y), WHITE, 17)
