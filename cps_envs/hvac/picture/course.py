"""The zone that suffers most, the residuals of the sets, and the impact, over the time of the episode."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from cps_envs.core.declare.config import extremes
from cps_envs.core.picture.canvas import SMALL, Box, Canvas
from cps_envs.core.picture.history import Curves
from cps_envs.core.picture.marks import Area, Disc, Dots, Event, LevelLine, Line, Mark, TimeLabels
from cps_envs.core.picture.palette import BELIEVED, DAMAGE, FALSE, INK, MUTED, TRUE, tint
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import Plot
from cps_envs.core.types import FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.picture.belief import clock
from cps_envs.hvac.picture.palette import WALL
from cps_envs.hvac.picture.scene import Scene

TIME_MARKS = 5
MINUTES = (1, 2, 5, 10, 15, 30, 60, 120, 180, 360, 720)  # between times that are written
DAY_MINUTES = 1440
LEAST_C = 2.0  # shown on both sides of the reference
HEADROOM = 1.1


def worst_zone(scene: Scene, curves: Curves) -> int:
    """The zone, from 0, with the largest sum of squared errors; since the onset, once that has come."""
    counted = curves["step"] >= (scene.onset if scene.step >= scene.onset else 0)
    return int(np.argmax(((curves["temperature"][counted] - curves["reference_c"][counted]) ** 2).sum(axis=0)))


def range_of(true: FloatArray, seen: FloatArray, config: HvacConfig) -> tuple[float, float]:
    """Whole degrees around the reference, all true temperatures, and what is seen of them within the sensor range."""
    low_c, high_c = extremes(config.sensor_low_c)[0], extremes(config.sensor_high_c)[1]
    seen = np.clip(seen, min(low_c, true.min()), max(high_c, true.max()))
    lowest, highest = (float(end(np.append(true, seen))) for end in (np.min, np.max))
    low_c, high_c = config.reference_range_c
    below = math.ceil(max(HEADROOM * (low_c - lowest), LEAST_C))
    above = math.ceil(max(HEADROOM * (highest - high_c), LEAST_C))
    return low_c - below, high_c + above


def temperature(box: Box, scene: Scene, curves: Curves) -> Panel:
    """True, estimated and forged temperature of the worst zone, thin lines for the other zones, and the reference."""
    config, step, zone = scene.config, curves["step"], worst_zone(scene, curves)
    n, time, acted = config.num_zones, step / scene.last_step, step > 0
    forged = acted & (step >= scene.onset)
    every, estimated = curves["temperature"], curves["estimate"][acted, zone]
    read = curves["reading"][forged, zone::n][:, scene.compromised[zone::n]]
    return Panel(
        Plot(box, *range_of(every, np.append(estimated, read), config)),
        f"Zone {zone + 1}, the worst so far: temperature (°C)",
        [
            *onset(scene),
            *(Line(time, other, WALL, thin=True) for other in every.T),
            wanted(scene, zone),
            *(Dots(time[forged], values, tint(FALSE, 0.8)) for values in read.T),
            Dots((step[acted] - 1) / scene.last_step, estimated, BELIEVED),
            Line(time, every[:, zone], TRUE),
            Disc(float(time[-1]), float(every[-1, zone]), TRUE),
        ],
    )


def wanted(scene: Scene, zone: int) -> Mark:
    """The set-point of a zone, over the whole episode where it changes."""
    course = scene.day.reference_c
    if len(course) == 0:
        return LevelLine(float(scene.reference_c[zone]), MUTED)
    return Line(np.linspace(0.0, 1.0, len(course)), course[:, zone], MUTED, thin=True)


def outside(box: Box, scene: Scene) -> Panel:
    """The forecast of the outside over the whole episode, and what it is now."""
    course = scene.day.outdoor_c
    low_c, high_c = min(float(course.min()), scene.outdoor_c), max(float(course.max()), scene.outdoor_c)
    line = Line(np.linspace(0.0, 1.0, len(course)), course, MUTED, thin=True)
    now = Disc(scene.step / scene.last_step, scene.outdoor_c, INK)
    return Panel(
        Plot(box, math.floor(low_c - 1.0), math.ceil(high_c + 1.0)), "Outside (°C), forecast and now", [line, now]
    )


def residuals(plot: Plot, scene: Scene, curves: Curves) -> Panel:
    """Between which values the mean residuals of intact and of flawed sets lie, that of the chosen set, and eps."""
    config, marks, ready = scene.config, list[Mark](onset(scene)), curves["ready"] > 0
    time = curves["step"][ready] / scene.last_step
    for group, color in ((scene.flawed, FALSE), (~scene.flawed, TRUE)):
        if group.any():
            means = curves["mean_residual"][ready][:, group]
            low, high = means.min(axis=1), means.max(axis=1)
            marks.append(Area(time, high, low, tint(color, 0.25)))
            marks += [Line(time, end, color, thin=True) for end in (low, high)]
    marks.append(LevelLine(config.threshold_c2, INK))
    if scene.ready and 0 < scene.choice <= len(scene.mean_residual):
        marks.append(
            Disc(scene.step / scene.last_step, float(scene.mean_residual[scene.choice - 1]), BELIEVED, radius=4.0)
        )
    if not scene.ready:
        marks.append(partial(draw_waiting, clock(config.window_steps, config)))
    threshold = (f"threshold {config.threshold_c2:.3g}", INK)
    return Panel(plot, "Mean residuals of intact and flawed sets (C²)", marks, note=threshold)


def draw_waiting(until: str, canvas: Canvas, plot: Plot) -> None:
    """Why there is nothing yet."""
    note = f"none before {until} h, when the observer's window is full"
    canvas.text(note, (plot.box[0] + plot.box[2] / 2, plot.box[1] + 14), MUTED, SMALL, align=0.5)


def impact(plot: Plot, scene: Scene, curves: Curves) -> Panel:
    """A_impact so far, and the time below."""
    curve = Line(curves["step"] / scene.last_step, curves["impact"], DAMAGE)
    marked = [(step / scene.last_step, clock(step, scene.config)) for step in marked_steps(scene.config)]
    return Panel(plot, "A_impact so far (C²)", [*onset(scene), curve, TimeLabels(marked, below=8)])


def marked_steps(config: HvacConfig) -> list[float]:
    """Steps at which the time is written: at most six, at round times."""
    last_minute = (config.num_steps - 1) * config.step_s / 60.0
    days = DAY_MINUTES * math.ceil(last_minute / DAY_MINUTES / TIME_MARKS)
    pitch = next((minutes for minutes in MINUTES if minutes * TIME_MARKS >= last_minute), days)
    return [minute * 60.0 / config.step_s for minute in range(0, math.floor(last_minute) + 1, pitch)]


def onset(scene: Scene) -> list[Event]:
    """Where the attack begins, once it has."""
    return [Event(scene.onset / scene.last_step, FALSE)] if scene.step >= scene.onset else []
