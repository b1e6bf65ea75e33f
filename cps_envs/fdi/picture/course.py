"""The target pair and the injections over the time of the episode."""

from __future__ import annotations

from functools import partial

import numpy as np

from cps_envs.core.picture.canvas import SMALL, Canvas
from cps_envs.core.picture.history import Curves
from cps_envs.core.picture.marks import Disc, Dots, LevelLine, Line, Mark, seconds
from cps_envs.core.picture.palette import BELIEVED, DAMAGE, FALSE, INK, MUTED, TRUE, Color, tint
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import Plot
from cps_envs.fdi.picture.outcome import is_certified
from cps_envs.fdi.picture.palette import FALSES
from cps_envs.fdi.picture.scene import Scene

SEEN = ("", "reported_", "used_", "believed_")  # true values, and what is made of them
MEASURED = tuple(f"{seen}{name}" for name in ("gap", "closing_speed") for seen in SEEN)


def target_gap(plot: Plot, scene: Scene, curves: Curves) -> Panel:
    """The target's gap, true and reported."""
    ahead = "reference" if scene.target == len(scene.gap) else str(scene.target + 1)
    desired, marks = (
        LevelLine(scene.config.desired_gap_m, MUTED),
        target_marks(plot, scene, curves, "gap", scene.target - 1),
    )
    return Panel(plot, f"Target gap, {scene.target} to {ahead}, over time (m)", [desired, *marks])


def target_closing_speed(plot: Plot, scene: Scene, curves: Curves) -> Panel:
    """The target's closing speed, true and reported, and what is certified about its impact."""
    marks = target_marks(plot, scene, curves, "closing_speed", len(scene.gap) + scene.target - 1)
    note: tuple[str, Color] | None = None
    if is_certified(scene):
        bound, color = scene.metrics["oracle_bound_mps"], INK if scene.metrics["bound_valid"] else MUTED
        marks, note = [LevelLine(bound, color), *marks], (f"certified {bound:.2f}", color)
    return Panel(plot, "Its closing speed over time (m/s)", marks, note=note)


def target_marks(plot: Plot, scene: Scene, curves: Curves, name: str, sensor: int) -> list[Mark]:
    """A curve of the truth, one of what an attacked sensor reported, and dots where the defender replaced that.

    What a filter believes is a pale curve.
    """
    pair, read, marks = scene.target - 1, curves["time_s"] > 0, list[Mark]()
    time, sensed = curves["time_s"] / scene.duration_s, curves["sensed_s"] / scene.duration_s
    true, reported, used, believed = (curves[f"{seen}{name}"][:, pair] for seen in SEEN)
    replaced = read & (curves["trusted"][:, sensor] == 0)
    if scene.attacked[sensor]:
        marks.append(Line(sensed[read], reported[read], FALSE))
        if read.any() and not plot.shows(reported[-1]):
            marks.append(partial(draw_outside, float(sensed[-1]), float(reported[-1])))
    if not np.isnan(believed).any():
        marks.append(Line(time, believed, tint(BELIEVED, 0.6)))
    marks += [Line(time, true, TRUE), Dots(sensed[replaced], used[replaced], BELIEVED, size=3)]
    end = (DAMAGE, 5.0) if scene.metrics["collided_target"] else (TRUE, 3.5)
    return [*marks, Disc(float(time[-1]), float(true[-1]), *end)]


def draw_outside(share: float, value: float, canvas: Canvas, plot: Plot) -> None:
    """A tip where a curve ends out of range, and its value."""
    x, y, up = float(plot.along(share)), plot.y(value), -1 if value > plot.high else 1
    canvas.polygon([(x - 5, y), (x + 5, y), (x, y + 6 * up)], FALSE)
    canvas.text(f"{value:.1f}", (x, y - 8 * up), FALSE, SMALL, align=0.5)


def injections(plot: Plot, scene: Scene, curves: Curves) -> Panel:
    """What is added to each attacked sensor, held for a step; the title names them with their present values."""
    read = curves["time_s"] > 0
    held_s = np.stack([curves["sensed_s"][read], curves["sensed_s"][read] + scene.config.dt_s], 1).ravel()
    words, marks = [], list[Mark]()
    for k, sensor in enumerate(np.flatnonzero(scene.attacked).tolist()):
        color, (name, unit) = FALSES[k % len(FALSES)], name_of(sensor, len(scene.gap))
        marks.append(Line(held_s / scene.duration_s, np.repeat(curves["injection"][read, sensor], 2), color))
        words.append((f"{name} {scene.injection[sensor]:+.4g} {unit}", color))
    title = "Nothing works yet" if scene.time_s < scene.attack_from_s else "Injected"
    return Panel(plot, title, [*marks, seconds(scene.duration_s)], words=words, spacing=10)


def name_of(sensor: int, n: int) -> tuple[str, str]:
    """What a sensor is called, fronts by kind, then rears of vehicles 2..n by kind; and its unit."""
    if sensor < 2 * n:
        return ("x", "v")[sensor // n] + str(sensor % n + 1), ("m", "m/s")[sensor // n]
    kind, place = divmod(sensor - 2 * n, n - 1)
    return ("rx", "rv")[kind] + str(place + 2), ("m", "m/s")[kind]
