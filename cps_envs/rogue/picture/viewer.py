"""The picture of a platoon with a seized vehicle: the road, what each vehicle does, and the episode so far."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.frame import INNER, MARGIN, WIDTH, draw_cards, draw_event, draw_header
from cps_envs.core.picture.palette import BORDER, INK, MUTED, PAGE, WHITE, Color
from cps_envs.core.picture.plot import AXIS, Plot, draw_times, rounded_up
from cps_envs.core.picture.vehicle import ASPHALT
from cps_envs.core.picture.viewer import CanvasViewer
from cps_envs.core.types import BoolArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import DRIVEN
from cps_envs.rogue.picture.bars import draw_damage, draw_detectors, draw_gaps, draw_numbers
from cps_envs.rogue.picture.curves import draw_damage_curve, draw_gap_curves, draw_speed_curves, events
from cps_envs.rogue.picture.history import Recording, Traces
from cps_envs.rogue.picture.overview import draw_overview
from cps_envs.rogue.picture.palette import ALARM, ATTACKER, BRAKING, DAMAGE, LAW_COLORS
from cps_envs.rogue.picture.road import draw_road
from cps_envs.rogue.picture.scene import Scene

CARD = 112.0  # pixels from card to card
ROAD_TOP, ROAD_HEIGHT = 118, 74
OVERVIEW_TOP, OVERVIEW_HEIGHT = 198, 12
PLOTS_TOP, PLOT_HEIGHT, PITCH = 236, 74, 93
GUTTER = 16  # pixels between the columns of plots
HEADROOM = 1.15  # of the axes over the largest values
STRUCK_S = 0.6  # how long a collision is marked
UNITS = {"pass": "m", "solid": "m/s"}
CONTACTS = {"pass": "vehicles pass through one another", "solid": "vehicles are solid"}
CAPTION = "Gaps to scale; lines show whom a vehicle follows"


class Viewer(CanvasViewer):
    """Draws scenes of one configuration; curves hold the moments of the same episode that it has seen before.

    Raises:
        MissingExtraError: no canvas is given, and pygame is not installed.
    """

    def __init__(self, config: RogueConfig, canvas: Canvas | None = None) -> None:
        super().__init__(canvas)
        self._config = config
        self._recording = Recording()

    def watch(self, scene: Scene) -> None:
        """Take a moment in without drawing it, so that later curves hold it."""
        self._recording.add(scene)

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        self.watch(scene)
        canvas = self._canvas
        struck = scene.touching | self._recording.damaged_since(scene.time_s - STRUCK_S)
        canvas.fill(PAGE)
        draw_progress(canvas, scene)
        draw_metrics(canvas, scene, (MARGIN, 52, INNER, 38), self._config.formation_weight_mps2 > 0)
        draw_status(canvas, scene, struck)
        draw_legend(canvas, self._config.defense_action)
        draw_road(canvas, scene, struck, (MARGIN, ROAD_TOP, INNER, ROAD_HEIGHT))
        draw_overview(canvas, scene, (MARGIN, OVERVIEW_TOP, INNER, OVERVIEW_HEIGHT))
        draw_plots(canvas, scene, self._recording.traces())


def draw_plots(canvas: Canvas, scene: Scene, traces: Traces) -> None:
    """Bars of each vehicle on the left, curves over time on the right."""
    unit = UNITS[scene.contact]
    (gap, gaps), (detector, speeds), (damage, damages) = plots(scene, traces)
    draw_gaps(canvas, scene, gap)
    draw_detectors(canvas, scene, detector)
    draw_damage(canvas, scene, damage, unit)
    draw_numbers(canvas, scene, damage)
    draw_gap_curves(canvas, scene, gaps, traces)
    draw_speed_curves(canvas, scene, speeds, traces)
    draw_damage_curve(canvas, scene, damages, traces, unit)
    draw_times(canvas, damages, scene.duration_s)


def plots(scene: Scene, traces: Traces) -> list[tuple[Plot, Plot]]:
    """Left and right plot of each row."""
    desired, m = scene.desired_gap_m, scene.attacker
    beside = traces.gap[:, max(m - 1, 0) : m + 1]
    lowest, highest = float(beside.min()), float(beside.max())
    shown = (-rounded_up(max(desired / 2, -HEADROOM * lowest)), rounded_up(max(3 * desired, HEADROOM * highest)))
    speed = rounded_up(max(1.5 * scene.reference_speed_mps, float(traces.speed.max())))
    worst, total = float(scene.damage.max()), float(scene.damage.sum())
    ranges = (
        ((-desired, 4 * desired), shown),
        ((0.0, 1.6), (0.0, speed)),
        ((0.0, rounded_up(max(1.0, HEADROOM * worst))), (0.0, rounded_up(max(1.0, HEADROOM * total)))),
    )
    width = (INNER - GUTTER) / 2
    pairs = []
    for row, (left, right) in enumerate(ranges):
        top = PLOTS_TOP + row * PITCH
        boxes = [(MARGIN + side * (width + GUTTER), top, width - AXIS, PLOT_HEIGHT) for side in (0, 1)]
        pairs.append((Plot(boxes[0], *left), Plot(boxes[1], *right)))
    return pairs


def draw_progress(canvas: Canvas, scene: Scene) -> None:
    """What is shown, the time, and the events on the bar of the episode's progress."""
    power = "" if scene.power_ratio == 1 else f", {scene.power_ratio:.3g} times as strong as the others"
    subtitle = (
        f"{len(scene.position)} vehicles, the attacker drives {scene.attacker + 1}{power}; {CONTACTS[scene.contact]}"
    )
    if scene.onset_s == np.inf:
        subtitle = f"{len(scene.position)} vehicles, an episode without an attack; {CONTACTS[scene.contact]}"
    draw_header(canvas, "Rogue vehicle", subtitle, scene.time_s, scene.duration_s)
    for time_s, color in events(scene):
        draw_event(canvas, time_s / scene.duration_s, color)


def draw_metrics(canvas: Canvas, scene: Scene, box: Box, charged: bool) -> None:
    """The metrics so far, and the attacker's effort."""
    left, top, width, height = box
    metrics, unit, intact = scene.metrics, UNITS[scene.contact], len(scene.position) - (not scene.hidden)
    charge, humans = f"{metrics['formation_charge']:.1f} {unit}", f"{metrics['humans']:.0f} of {intact}"
    values = [
        ("Attacker's speed", f"{scene.speed[scene.attacker]:.1f} m/s"),
        ("Damage", f"{metrics['damage']:.1f} {unit}"),
        ("Contacts", f"{metrics['collisions']:.0f}"),
        ("Alarms", f"{metrics['alarms']:.0f} of {intact}"),
        ("Human drivers", humans),
        ("Leader's lag", f"{round(metrics['reference_error_m'], 1) + 0.0:.1f} m"),
    ]
    if charged:
        values.insert(2, ("Scattering", charge))
    draw_cards(canvas, values, box, CARD)
    begin = len(values) * CARD + 8
    draw_gauge(canvas, scene, (left + begin, top, width - begin, height))


def draw_gauge(canvas: Canvas, scene: Scene, box: Box) -> None:
    """The attacker's effort between full braking and full driving."""
    left, top, width, _ = box
    low, high = scene.effort_limits
    zero = left + width * -low / (high - low)
    color = ATTACKER if scene.effort > 0 else BRAKING
    canvas.text("Attacker's effort", (left, top + 5), MUTED, 16)
    canvas.text(f"{round(scene.effort, 2) + 0.0:+.2f}", (left + width, top + 5), color, 18, align=1)
    canvas.box((left, top + 13, width, 9), BORDER, radius=2)
    end = left + width * (min(max(scene.effort, low), high) - low) / (high - low)
    if abs(end - zero) >= 1:
        canvas.box((min(zero, end), top + 13, abs(end - zero), 9), color, radius=2)
    canvas.box((zero - 1, top + 11, 2, 13), INK)
    canvas.text(f"brake {low:g}", (left, top + 31), MUTED, 16)
    canvas.text(f"drive {high:g}", (left + width, top + 31), MUTED, 16, align=1)


def draw_status(canvas: Canvas, scene: Scene, struck: BoolArray) -> None:
    """Who collides, when the attack begins, or how the road is drawn."""
    y = 104.0
    pairs = np.flatnonzero(struck).tolist()
    if not pairs:
        canvas.text(belief(scene) if scene.hidden else caption(scene), (MARGIN, y), MUTED, 16)
        return
    more = f" and {len(pairs) - 3} more pairs" if len(pairs) > 3 else ""
    note = "Contact: " + ", ".join(f"{pair + 1} and {pair + 2}" for pair in pairs[:3]) + more
    canvas.box((MARGIN, y - 9, canvas.text_width(note, WHITE, 17) + 16, 18), DAMAGE, radius=4)
    canvas.text(note, (MARGIN + 8, y), WHITE, 17)


def caption(scene: Scene) -> str:
    """When the attack begins, and then how the road is drawn."""
    return f"The attack begins at {scene.onset_s:.1f} s" if scene.time_s < scene.onset_s else CAPTION


def belief(scene: Scene) -> str:
    """Whom the alarms blame, beside what is true."""
    blamed = ", ".join(str(vehicle + 1) for vehicle in scene.blamed) or "nobody"
    true = f"{scene.attacker + 1} attacks from {scene.onset_s:.1f} s on" if scene.onset_s < np.inf else "nobody attacks"
    return f"Alarms blame {blamed}; {true}"


def draw_legend(canvas: Canvas, defense_action: str) -> None:
    """What the colours of the vehicles mean."""
    y, right = 104.0, float(WIDTH - MARGIN)
    laws = {"mode": DRIVEN, "command": ("commanded",), "either": (*DRIVEN, "commanded")}[defense_action]
    entries: list[tuple[str, Color]] = [(law, LAW_COLORS[law]) for law in laws]
    for label, color in reversed([("attacker", ATTACKER), *entries, ("alarm", ALARM)]):
        right -= canvas.text_width(label, INK, 15)
        canvas.text(label, (right, y), INK, 15)
        right -= 19
        if label == "alarm":
            canvas.polygon([(right + 12, y), (right + 3, y - 5), (right + 3, y + 5)], color)
        else:
            canvas.box((right, y - 7, 15, 14), ASPHALT, radius=3)
            canvas.box((right + 2, y - 5, 11, 10), color, radius=2)
        right -= 12
