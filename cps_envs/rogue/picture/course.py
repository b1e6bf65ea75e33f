"""Gaps beside the attacker, speeds, effort and damage over the time of the episode."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np

from cps_envs.core.picture.canvas import SMALL, Canvas
from cps_envs.core.picture.history import Curves
from cps_envs.core.picture.marks import Area, Disc, Event, LevelLine, Line, Mark, decimal, seconds
from cps_envs.core.picture.palette import DAMAGE, MUTED, Color, tint
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import AXIS, Plot
from cps_envs.core.types import FloatArray
from cps_envs.rogue.picture.palette import AHEAD, ALARM, ATTACKER, BEHIND, BRAKING, OTHER
from cps_envs.rogue.picture.scene import Scene

STRIP = 6  # pixels of what shows the attacker's effort
LEVELS = 10  # of effort that its colours tell apart, on either side of zero
EFFORTS = {k: tint(ATTACKER if k > 0 else BRAKING, abs(k) / LEVELS) for k in range(-LEVELS, LEVELS + 1)}


def gap_curves(plot: Plot, scene: Scene, curves: Curves) -> Panel:
    """The gaps ahead of the attacker and behind it."""
    marks: list[Mark] = [LevelLine(scene.desired_gap_m, MUTED), LevelLine(0.0, DAMAGE, solid=True), *onsets(scene)]
    words = []
    for pair, name, color in ((scene.attacker - 1, "behind", BEHIND), (scene.attacker, "ahead", AHEAD)):
        if 0 <= pair < len(scene.gap):
            words.append((f"{name} {decimal(float(scene.gap[pair]))}", color))
            marks += trace(scene, curves, curves["gap"][:, pair], color)
    return Panel(plot, "Gaps beside the attacker (m):", marks, words=words)


def speed_curves(plot: Plot, scene: Scene, curves: Curves) -> Panel:
    """The speeds of all, those of the attacker and its neighbours in colours, and its effort as a strip."""
    m, time, words = scene.attacker, curves["time_s"] / scene.config.duration_s, []
    marks: list[Mark] = [LevelLine(scene.reference_speed_mps, MUTED), *onsets(scene)]
    if scene.config.has_cycle:
        marks[0] = Line(time, curves["reference_speed_mps"], MUTED)
    others = [i for i in range(len(scene.speed)) if abs(i - m) > 1 and not scene.rogue[i]]
    marks += [Line(time, curves["speed"][:, i], OTHER, thin=True) for i in others]
    for i, name, color in ((m - 1, "behind", BEHIND), (m + 1, "ahead", AHEAD), (m, "attacker", ATTACKER)):
        if 0 <= i < len(scene.speed):
            words.append((f"{name} {scene.speed[i]:.1f}", color))
            marks += trace(scene, curves, curves["speed"][:, i], color)
    marks += [Line(time, curves["speed"][:, i], ATTACKER, thin=True) for i in scene.seized if i > m]
    marks += [draw_strip_names, partial(draw_effort, scene, time, curves["effort"])]
    return Panel(plot, "Speeds (m/s):", marks, words=words)


def damage_curve(plot: Plot, scene: Scene, curves: Curves, unit: str) -> Panel:
    """The damage of all pairs together."""
    time, damage = curves["time_s"] / scene.config.duration_s, curves["damage"].sum(axis=1)
    marks: list[Mark] = [Area(time, damage, 0.0, tint(DAMAGE, 0.16))] if scene.damage.any() else []
    marks += [*onsets(scene), *trace(scene, curves, damage, DAMAGE), seconds(scene.config.duration_s)]
    return Panel(plot, f"Damage of all pairs ({unit}):", marks, words=[(f"{scene.damage.sum():.1f}", DAMAGE)])


def draw_strip_names(canvas: Canvas, plot: Plot) -> None:
    """What the colours of the strip mean, above the right end of the panel."""
    right, y = plot.box[0] + plot.box[2] + AXIS, plot.box[1] - 7
    for label, color in (("brake", BRAKING), ("drive,", ATTACKER), ("strip:", MUTED)):
        right -= canvas.text(label, (right, y), color, SMALL, align=1) + 4


def draw_effort(scene: Scene, time: FloatArray, effort: FloatArray, canvas: Canvas, plot: Plot) -> None:
    """A strip along the bottom: the attacker's effort up to each moment, driving or braking."""
    _, top, _, height = plot.box
    low, high = scene.config.min_effort, scene.config.max_effort
    x, shares = plot.along(time), np.where(effort > 0, effort / high, -effort / (low or -1.0)).clip(-1.0, 1.0)
    levels = np.rint(shares * LEVELS).astype(np.int64)[1:]
    begins = np.flatnonzero(np.diff(levels, prepend=LEVELS + 1)).tolist()
    for begin, end in pairwise([*begins, len(levels)]):
        left, right = float(x[begin]), float(x[end])
        canvas.box((left, top + height - STRIP, right - left, STRIP), EFFORTS[int(levels[begin])])


def trace(scene: Scene, curves: Curves, values: FloatArray, color: Color) -> list[Mark]:
    """A curve with a disc at its end."""
    time = curves["time_s"] / scene.config.duration_s
    return [Line(time, values, color), Disc(float(time[-1]), float(values[-1]), color)]


def onsets(scene: Scene) -> list[Event]:
    """The onset of the attack, the first alarm and the first contact, as far as they have been."""
    times = (
        (scene.onset_s or -1.0, ATTACKER),
        (scene.metrics["first_alarm_s"], ALARM),
        (scene.metrics["first_collision_s"], DAMAGE),
    )
    return [Event(time_s / scene.config.duration_s, color) for time_s, color in times if 0 <= time_s <= scene.time_s]
