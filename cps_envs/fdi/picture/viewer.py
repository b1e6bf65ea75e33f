"""The picture of a platoon under false data injection: the road, what sensors report, and the course of the episode."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cps_envs.core.picture.frame import INNER, MARGIN, Frame, LegendEntry
from cps_envs.core.picture.gauge import Gauge
from cps_envs.core.picture.history import History
from cps_envs.core.picture.palette import BELIEVED, DAMAGE, FALSE, INK, MUTED, TRUE, tint
from cps_envs.core.picture.panel import Panel, side_by_side
from cps_envs.core.picture.plot import Plot, rounded_up
from cps_envs.core.picture.viewer import RememberingViewer
from cps_envs.fdi.picture.course import MEASURED, injections, target_closing_speed, target_gap
from cps_envs.fdi.picture.outcome import certificate_of, is_certified, outcome_of, task_of
from cps_envs.fdi.picture.palette import TARGET
from cps_envs.fdi.picture.profile import closing_speeds, commands, gaps
from cps_envs.fdi.picture.road import draw_road
from cps_envs.fdi.picture.scene import Scene

CARD = 138.0  # pixels from card to card
ROAD_TOP, ROAD_HEIGHT = 116, 118
PLOTS_TOP, PLOT_HEIGHT, PITCH = 256, 74, 90
BELOW_ZERO = 0.4  # desired gaps shown below zero, for collisions
HEADROOM = 1.25  # of the axes over the largest values
CAPTION = "Gaps to scale; above the road the gap and closing speed that a vehicle believes"
LEGEND = (
    LegendEntry("true", TRUE),
    LegendEntry("falsified sensor", FALSE),
    LegendEntry("replaced by the defender", BELIEVED),
    LegendEntry("target pair", TARGET),
)
CARDS = (
    ("Falsified readings", "injected_share"),
    ("Replaced readings", "replaced_share"),
    ("False alarms", "false_alarm_rate"),
)


class FdiViewer(RememberingViewer):
    """The target over time beside what every vehicle does now."""

    moment = ("time_s", "sensed_s")  # an illegal injection stops the clock
    kept = ("command", "injection", "trusted", *MEASURED)
    most_points = 600

    def watch(self, scene: Scene) -> None:
        """Take a moment in, with the readings that it shows."""
        super().watch(with_illegal_readings(scene))

    def draw(self, scene: Scene) -> None:
        """Draw a scene on the canvas."""
        self.watch(scene)
        shown = with_illegal_readings(scene)
        frame_of(shown).draw(self._canvas)
        draw_road(self._canvas, shown, (MARGIN, ROAD_TOP, INNER, ROAD_HEIGHT))
        for panel in panels(shown, self._history):
            panel.draw(self._canvas)


def with_illegal_readings(scene: Scene) -> Scene:
    """The scene with the readings of an illegal injection, which the vehicles never got to act on."""
    if not scene.metrics["illegal"]:
        return scene
    n = len(scene.gap)
    gap, closing_speed = scene.gap + scene.injection[:n], scene.closing_speed - scene.injection[n:]
    return replace(
        scene,
        reported_gap=gap,
        reported_closing_speed=closing_speed,
        used_gap=gap,
        used_closing_speed=closing_speed,
        trusted=np.ones_like(scene.trusted),
    )


def panels(scene: Scene, history: History) -> list[Panel]:
    """Those of all vehicles, then those of the target over time; of gaps and closing speeds both have one range."""
    gap, speed, command, injection = ranges(scene, history)
    left, right = side_by_side(PLOTS_TOP, PLOT_HEIGHT, PITCH)
    curves, n = history.curves(), len(scene.gap)
    return [
        gaps(Plot(left[0], *gap, columns=n), scene),
        closing_speeds(Plot(left[1], *speed, columns=n), scene),
        commands(Plot(left[2], *command, columns=n), scene),
        target_gap(Plot(right[0], *gap), scene, curves),
        target_closing_speed(Plot(right[1], *speed), scene, curves),
        injections(Plot(right[2], *injection), scene, curves),
    ]


def ranges(scene: Scene, history: History) -> list[tuple[float, float]]:
    """Of gaps, closing speeds, commands and injections: they hold what any vehicle has had in the episode."""
    config, seen = scene.config, history.every()
    closing, commanded = seen["closing_speed"], float(np.abs(seen["command"]).max())
    low, high = config.min_acceleration_mps2, config.max_acceleration_mps2
    if not config.limit_commands:
        high = rounded_up(max(high, commanded))
        low = -high
    injection = rounded_up(max(10 * config.range_resolution_m, float(np.abs(seen["injection"]).max())))
    widest = rounded_up(max(3 * config.desired_gap_m, HEADROOM * float(seen["gap"].max())))
    opening = rounded_up(HEADROOM * max(5.0, -float(closing.min())))
    return [
        (-BELOW_ZERO * config.desired_gap_m, widest),
        (-opening, rounded_up(HEADROOM * max(8.0, float(closing.max())))),
        (HEADROOM * low, HEADROOM * high),
        (-injection, injection),
    ]


def frame_of(scene: Scene) -> Frame:
    """The task, the target and the metrics so far, how the road is drawn or how the episode ended."""
    i, outcome = scene.target - 1, outcome_of(scene)
    closing = float(scene.closing_speed[i]) + 0.0  # no minus before zero
    cards = [("Target gap", f"{scene.gap[i]:.2f} m"), ("Target closing at", f"{closing:.2f} m/s")]
    ended = bool(scene.metrics["collided_pairs"] or scene.metrics["illegal"])
    return Frame(
        title="False data injection",
        subtitle=task_of(scene),
        time=(f"{scene.time_s:.2f} s", f"{scene.duration_s:g} s"),
        progress=scene.time_s / scene.duration_s,
        cards=[*cards, *((label, f"{100.0 * scene.metrics[name]:.1f} %") for label, name in CARDS)],
        pitch=CARD,
        gauge=growth(scene) if "error_growth_m" in scene.metrics else impact(scene),
        caption=outcome or CAPTION,
        badge=(DAMAGE if ended else MUTED) if outcome else None,
        legend=LEGEND,
    )


def impact(scene: Scene) -> Gauge:
    """The target's closing speed, then the impact speed, beside what is certified."""
    metrics, closing = scene.metrics, float(scene.closing_speed[scene.target - 1])
    bound, speed = metrics["oracle_bound_mps"], metrics["impact_speed_mps"]
    color = INK if metrics["bound_valid"] else MUTED
    full = rounded_up(max(10.0, speed, closing, bound if math.isfinite(bound) else 0.0))
    return Gauge(
        title="Impact speed (m/s)",
        value=f"{speed:.2f}" if metrics["collided_pairs"] else "none yet",
        color=DAMAGE if metrics["collided_pairs"] else MUTED,
        fills=[(0.0, value / full, hue) for value, hue in ((closing, tint(TRUE, 0.5)), (speed, DAMAGE)) if value > 0],
        below=[(certificate_of(scene), 0.0)],
        mark=(bound / full, color) if is_certified(scene) else None,
        reach=3,
        ink=color,
    )


def growth(scene: Scene) -> Gauge:
    """What the errors have grown, for an attacker who is after instability."""
    grown_m = float(scene.metrics["error_growth_m"])
    return Gauge(
        title="Errors have grown by (m)",
        value=f"{grown_m:.2f}",
        color=DAMAGE if grown_m > 0 else MUTED,
        fills=[(0.0, grown_m / rounded_up(max(10.0, grown_m)), DAMAGE)] if grown_m > 0 else [],
        below=[("nothing certified for this goal", 0.0)],
    )
