"""The picture of a platoon with a seized vehicle: the road, what each vehicle does, and the episode so far."""

from __future__ import annotations

from functools import partial

import numpy as np

from cps_envs.core.picture.canvas import Canvas, Point
from cps_envs.core.picture.frame import INNER, MARGIN, Frame, LegendEntry
from cps_envs.core.picture.gauge import Gauge
from cps_envs.core.picture.history import Curves, History
from cps_envs.core.picture.marks import decimal
from cps_envs.core.picture.palette import DAMAGE, INK, Color
from cps_envs.core.picture.panel import Panel, side_by_side
from cps_envs.core.picture.plot import Plot, rounded_up
from cps_envs.core.picture.vehicle import ASPHALT
from cps_envs.core.picture.viewer import RememberingViewer
from cps_envs.core.types import BoolArray
from cps_envs.rogue.controllers import DRIVEN
from cps_envs.rogue.picture.course import damage_curve, gap_curves, onsets, speed_curves
from cps_envs.rogue.picture.overview import draw_overview
from cps_envs.rogue.picture.palette import ALARM, ATTACKER, BRAKING, LAW_COLORS
from cps_envs.rogue.picture.profile import damages, detectors, gaps
from cps_envs.rogue.picture.road import draw_road
from cps_envs.rogue.picture.scene import Scene

CARD = 112.0  # pixels from card to card
ROAD_TOP, ROAD_HEIGHT = 118, 74
OVERVIEW_TOP, OVERVIEW_HEIGHT = 198, 12
PLOTS_TOP, PLOT_HEIGHT, PITCH = 236, 74, 93
HEADROOM = 1.15  # of the axes over the largest values
STRUCK_S = 0.6  # how long a collision is marked
UNITS = {"pass": "m", "solid": "m/s"}
CONTACTS = {"pass": "vehicles pass through one another", "solid": "vehicles are solid"}
CAPTION = "Gaps to scale; lines show whom a vehicle follows"
LAWS = {"mode": DRIVEN, "command": ("commanded",), "either": (*DRIVEN, "commanded")}  # of each action of the defender


class RogueViewer(RememberingViewer):
    """The road, and below it what each vehicle does now beside the episode so far."""

    kept = ("effort", "speed", "gap", "damage", "reference_speed_mps")
    most_points = 300

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        self.watch(scene)
        struck = scene.touching | damaged_since(self._history, scene.time_s - STRUCK_S)
        frame_of(scene, struck).draw(self._canvas)
        draw_road(self._canvas, scene, struck, (MARGIN, ROAD_TOP, INNER, ROAD_HEIGHT))
        draw_overview(self._canvas, scene, (MARGIN, OVERVIEW_TOP, INNER, OVERVIEW_HEIGHT))
        for panel in panels(scene, self._history.curves()):
            panel.draw(self._canvas)


def damaged_since(history: History, time_s: float) -> BoolArray:
    """Pairs (n - 1,) that have taken damage since the last moment before a time."""
    seen = history.every()
    first = max(int(np.searchsorted(seen["time_s"], time_s)) - 1, 0)
    damaged: BoolArray = seen["damage"][-1] > seen["damage"][first]
    return damaged


def panels(scene: Scene, curves: Curves) -> list[Panel]:
    """Bars of each vehicle on the left, curves over time on the right."""
    desired, m, n, unit = scene.desired_gap_m, scene.attacker, len(scene.position), UNITS[scene.config.contact]
    beside = curves["gap"][:, max(m - 1, 0) : m + 1]
    lowest, highest = float(beside.min()), float(beside.max())
    shown = (-rounded_up(max(desired / 2, -HEADROOM * lowest)), rounded_up(max(3 * desired, HEADROOM * highest)))
    speed = rounded_up(max(1.5 * float(curves["reference_speed_mps"].max()), float(curves["speed"].max()), 1.0))
    worst, total = (rounded_up(max(1.0, HEADROOM * float(value))) for value in (scene.damage.max(), scene.damage.sum()))
    left, right = side_by_side(PLOTS_TOP, PLOT_HEIGHT, PITCH)
    return [
        gaps(Plot(left[0], -desired, 4 * desired, columns=n), scene),
        detectors(Plot(left[1], 0.0, 1.6, columns=n), scene),
        damages(Plot(left[2], 0.0, worst, columns=n), scene, unit),
        gap_curves(Plot(right[0], *shown), scene, curves),
        speed_curves(Plot(right[1], 0.0, speed), scene, curves),
        damage_curve(Plot(right[2], 0.0, total), scene, curves, unit),
    ]


def frame_of(scene: Scene, struck: BoolArray) -> Frame:
    """The task, the events, the metrics so far, and who collides or how the road is drawn."""
    config, caption, pairs = scene.config, caption_of(scene), np.flatnonzero(struck).tolist()
    if pairs:
        more = f" and {len(pairs) - 3} more pairs" if len(pairs) > 3 else ""
        caption = "Contact: " + ", ".join(f"{pair + 1} and {pair + 2}" for pair in pairs[:3]) + more
    return Frame(
        title="Rogue vehicle",
        subtitle=subtitle(scene),
        time=(f"{scene.time_s:.1f} s", f"{config.duration_s:g} s"),
        progress=scene.time_s / config.duration_s,
        cards=cards(scene),
        pitch=CARD,
        events=onsets(scene),
        gauge=effort(scene),
        caption=caption,
        badge=DAMAGE if pairs else None,
        legend=legend(config.defense_action),
    )


def subtitle(scene: Scene) -> str:
    """Who drives what, and what a contact means."""
    vehicles, contact = f"{len(scene.position)} vehicles", CONTACTS[scene.config.contact]
    if scene.onset_s == np.inf:
        return f"{vehicles}, an episode without an attack; {contact}"
    power = "" if scene.power_ratio == 1 else f", {scene.power_ratio:.3g} times as strong as the others"
    return f"{vehicles}, the attacker drives {seats_of(scene)}{power}; {contact}"


def seats_of(scene: Scene) -> str:
    """The numbers of the seized vehicles: "2 and 4"."""
    *others, last = (str(i + 1) for i in scene.seized)
    return f"{', '.join(others)} and {last}" if others else last


def cards(scene: Scene) -> list[tuple[str, str]]:
    """The metrics so far; with what scattering costs, if it does."""
    config, metrics, unit = scene.config, scene.metrics, UNITS[scene.config.contact]
    charge = f"{metrics['formation_charge']:.1f} {unit}"
    scattering = [("Scattering", charge)] if config.formation_weight_mps2 > 0 else []
    intact = len(scene.position) - (0 if config.hidden else len(scene.seized))
    return [
        ("Attacker's speed", f"{scene.speed[scene.attacker]:.1f} m/s"),
        ("Damage", f"{metrics['damage']:.1f} {unit}"),
        *scattering,
        ("Contacts", f"{metrics['collisions']:.0f}"),
        ("Alarms", f"{metrics['alarms']:.0f} of {intact}"),
        ("Human drivers", f"{metrics['humans']:.0f} of {intact}"),
        ("Leader's lag", f"{decimal(metrics['reference_error_m'])} m"),
    ]


def effort(scene: Scene) -> Gauge:
    """The attacker's effort between full braking and full driving."""
    low, high = scene.config.min_effort, scene.config.max_effort
    color, zero = ATTACKER if scene.effort > 0 else BRAKING, -low / (high - low)
    end = (min(max(scene.effort, low), high) - low) / (high - low)
    return Gauge(
        title="Attacker's effort",
        value=decimal(scene.effort, 2, "+"),
        color=color,
        fills=[(min(zero, end), max(zero, end), color)] if scene.effort else [],
        below=[(f"brake {low:g}", 0.0), (f"drive {high:g}", 1.0)],
        mark=(zero, INK),
    )


def caption_of(scene: Scene) -> str:
    """Whom the alarms blame, where the attacker hides; else when the attack begins, and then how the road is drawn."""
    if scene.config.hidden:
        return belief(scene)
    return f"The attack begins at {scene.onset_s:.1f} s" if scene.time_s < scene.onset_s else CAPTION


def belief(scene: Scene) -> str:
    """Whom the alarms blame, beside what is true."""
    blamed = ", ".join(str(vehicle + 1) for vehicle in scene.blamed) or "nobody"
    attacks = "attacks" if len(scene.seized) == 1 else "attack"
    true = f"{seats_of(scene)} {attacks} from {scene.onset_s:.1f} s on" if scene.onset_s < np.inf else "nobody attacks"
    return f"Alarms blame {blamed}; {true}"


def legend(defense_action: str) -> list[LegendEntry]:
    """What the colours of the vehicles mean."""
    laws = ("attacker", *LAWS[defense_action])
    entries = [LegendEntry(law, partial(draw_paint, LAW_COLORS[law]), width=19, space=12) for law in laws]
    return [*entries, LegendEntry("alarm", draw_alarm, width=19, space=12)]


def draw_paint(color: Color, canvas: Canvas, at: Point) -> None:
    """A piece of road with a colour on it."""
    canvas.box((at[0], at[1] - 7, 15, 14), ASPHALT, radius=3)
    canvas.box((at[0] + 2, at[1] - 5, 11, 10), color, radius=2)


def draw_alarm(canvas: Canvas, at: Point) -> None:
    """A tip as above vehicles that have raised the alarm."""
    x, y = at
    canvas.polygon([(x + 12, y), (x + 3, y - 5), (x + 3, y + 5)], ALARM)
