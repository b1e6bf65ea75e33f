"""Gaps beside the attacker, speeds, effort and damage over the time of the episode."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cps_envs.core.picture.canvas import Canvas, Point
from cps_envs.core.picture.palette import MUTED, Color, tint
from cps_envs.core.picture.plot import AXIS, SMALL, Plot, draw_curve, draw_edge, draw_level, draw_panel, draw_title
from cps_envs.core.types import FloatArray
from cps_envs.rogue.picture.history import Traces
from cps_envs.rogue.picture.palette import AHEAD, ALARM, ATTACKER, BEHIND, BRAKING, DAMAGE, OTHER
from cps_envs.rogue.picture.scene import Scene

STRIP = 6  # pixels of what shows the attacker's effort
LEVELS = 10  # of effort that its colours tell apart, on either side of zero
EFFORTS = {k: tint(ATTACKER if k > 0 else BRAKING, abs(k) / LEVELS) for k in range(-LEVELS, LEVELS + 1)}


def draw_gap_curves(canvas: Canvas, scene: Scene, plot: Plot, traces: Traces) -> None:
    """The gaps ahead of the attacker and behind it."""
    draw_panel(canvas, plot)
    draw_level(canvas, plot, scene.desired_gap_m, MUTED)
    canvas.box((plot.box[0], round(plot.y(0.0)), plot.box[2], 1), DAMAGE)
    draw_events(canvas, scene, plot)
    x = plot.along(traces.time_s / scene.duration_s)
    end = draw_title(canvas, plot, "Gaps beside the attacker (m):")
    for pair, name, color in ((scene.attacker - 1, "behind", BEHIND), (scene.attacker, "ahead", AHEAD)):
        if pair >= 0:
            end = draw_name(canvas, plot, end, f"{name} {round(float(scene.gap[pair]), 1) + 0.0:.1f}", color)
            draw_trace(canvas, plot, x, traces.gap[:, pair], color)
    draw_edge(canvas, plot)


def draw_speed_curves(canvas: Canvas, scene: Scene, plot: Plot, traces: Traces) -> None:
    """The speeds of all, those of the attacker and its neighbours in colours, and its effort as a strip."""
    draw_panel(canvas, plot)
    draw_level(canvas, plot, scene.reference_speed_mps, MUTED)
    draw_events(canvas, scene, plot)
    x = plot.along(traces.time_s / scene.duration_s)
    m, end = scene.attacker, draw_title(canvas, plot, "Speeds (m/s):")
    for i in range(len(scene.speed)):
        if abs(i - m) > 1:
            draw_thinly(canvas, plot.points(x, traces.speed[:, i]))
    for i, name, color in ((m - 1, "behind", BEHIND), (m + 1, "ahead", AHEAD), (m, "attacker", ATTACKER)):
        if i >= 0:
            end = draw_name(canvas, plot, end, f"{name} {scene.speed[i]:.1f}", color)
            draw_trace(canvas, plot, x, traces.speed[:, i], color)
    draw_strip_names(canvas, plot)
    draw_effort(canvas, scene, plot, x, traces.effort)
    draw_edge(canvas, plot)


def draw_strip_names(canvas: Canvas, plot: Plot) -> None:
    """What the colours of the strip mean, above the right end of the panel."""
    right, y = plot.box[0] + plot.box[2] + AXIS, plot.box[1] - 7
    for label, color in (("brake", BRAKING), ("drive,", ATTACKER), ("strip:", MUTED)):
        right -= canvas.text(label, (right, y), color, SMALL, align=1) + 4


def draw_effort(canvas: Canvas, scene: Scene, plot: Plot, x: FloatArray, effort: FloatArray) -> None:
    """A strip along the bottom: the attacker's effort up to each moment, driving or braking."""
    _, top, _, height = plot.box
    low, high = scene.effort_limits
    shares = np.where(effort > 0, effort / high, -effort / (low or -1.0)).clip(-1.0, 1.0)
    levels = np.rint(shares * LEVELS).astype(np.int64)[1:]
    begins = np.flatnonzero(np.diff(levels, prepend=LEVELS + 1)).tolist()
    for begin, end in pairwise([*begins, len(levels)]):
        left, right = float(x[begin]), float(x[end])
        canvas.box((left, top + height - STRIP, right - left, STRIP), EFFORTS[int(levels[begin])])


def draw_damage_curve(canvas: Canvas, scene: Scene, plot: Plot, traces: Traces, unit: str) -> None:
    """The damage of all pairs together."""
    draw_panel(canvas, plot)
    x = plot.along(traces.time_s / scene.duration_s)
    points = plot.points(x, traces.damage.sum(axis=1))
    if len(points) > 1 and scene.damage.any():
        base = plot.y(0.0)
        canvas.polygon([*points, (points[-1][0], base), (points[0][0], base)], tint(DAMAGE, 0.16))
    draw_events(canvas, scene, plot)
    draw_trace(canvas, plot, x, traces.damage.sum(axis=1), DAMAGE)
    end = draw_title(canvas, plot, f"Damage of all pairs ({unit}):")
    draw_name(canvas, plot, end, f"{scene.damage.sum():.1f}", DAMAGE)
    draw_edge(canvas, plot)


def draw_trace(canvas: Canvas, plot: Plot, x: FloatArray, values: FloatArray, color: Color) -> None:
    """A curve with a dot at its end."""
    points = plot.points(x, values)
    draw_curve(canvas, points, color)
    canvas.circle(points[-1], 3.5, color)


def draw_thinly(canvas: Canvas, points: list[Point]) -> None:
    """A curve that is there to be compared with."""
    if len(points) > 1:
        canvas.path(points, OTHER)


def draw_name(canvas: Canvas, plot: Plot, end: float, label: str, color: Color) -> float:
    """A further part of a title in a colour; returns where it ends."""
    return end + 9 + canvas.text(label, (end + 9, plot.box[1] - 7), color, SMALL)


def draw_events(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """Upright lines at the onset of the attack, the first alarm and the first contact."""
    for time_s, color in events(scene):
        x = float(plot.along(time_s / scene.duration_s))
        canvas.box((round(x), plot.box[1], 1, plot.box[3]), color)


def events(scene: Scene) -> list[tuple[float, Color]]:
    """Times (s) of what has happened so far, and their colours."""
    times = (
        (scene.onset_s or -1.0, ATTACKER),
        (scene.metrics["first_alarm_s"], ALARM),
        (scene.metrics["first_collision_s"], DAMAGE),
    )
    return [(time_s, color) for time_s, color in times if 0 <= time_s <= scene.time_s]
