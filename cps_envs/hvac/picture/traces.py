"""The zone that suffers most, the residuals of the sets, and the impact, over the time of the episode."""

from __future__ import annotations

import math

import numpy as np

from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.palette import INK, MUTED, tint
from cps_envs.core.picture.plot import (
    ROOM,
    SMALL,
    Plot,
    draw_curve,
    draw_dots,
    draw_edge,
    draw_level,
    draw_panel,
    draw_title,
)
from cps_envs.core.types import FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.picture.belief import clock
from cps_envs.hvac.picture.history import FLAWED_HIGH, FLAWED_LOW, IMPACT, INTACT_HIGH, INTACT_LOW, STEP, ZONES
from cps_envs.hvac.picture.palette import DAMAGE, ESTIMATE, FALSE, TRUE, WALL
from cps_envs.hvac.picture.scene import Scene

TIME_MARKS = 5
MINUTES = (1, 2, 5, 10, 15, 30, 60, 120, 180, 360, 720)  # between times that are written
DAY_MINUTES = 1440
LEAST_C = 2.0  # shown on both sides of the reference
HEADROOM = 1.1


def worst_zone(scene: Scene, rows: FloatArray, config: HvacConfig) -> int:
    """The zone, from 0, with the largest sum of squared errors; since the onset, once that has come."""
    counted = rows[rows[:, STEP] >= (scene.onset if scene.step >= scene.onset else 0)]
    errors = counted[:, ZONES : ZONES + config.num_zones] - config.reference_c
    return int(np.argmax((errors**2).sum(axis=0)))


def temperatures_of(rows: FloatArray, zone: int, config: HvacConfig) -> tuple[FloatArray, FloatArray, FloatArray]:
    """True (k,), estimated (k,) and, by its sensors, read (k, 1 or 2) temperature of a zone."""
    n = config.num_zones
    return rows[:, ZONES + zone], rows[:, ZONES + n + zone], rows[:, ZONES + 2 * n + zone :: n]


def range_of(true: FloatArray, seen: FloatArray, config: HvacConfig) -> tuple[float, float]:
    """Whole degrees around the reference, all true temperatures, and what is seen of them within the sensor range."""
    seen = np.clip(seen, min(config.sensor_low_c, true.min()), max(config.sensor_high_c, true.max()))
    lowest, highest = (float(end(np.append(true, seen))) for end in (np.min, np.max))
    below = math.ceil(max(HEADROOM * (config.reference_c - lowest), LEAST_C))
    above = math.ceil(max(HEADROOM * (highest - config.reference_c), LEAST_C))
    return config.reference_c - below, config.reference_c + above


def draw_temperature(canvas: Canvas, scene: Scene, box: Box, rows: FloatArray, config: HvacConfig) -> None:
    """True, estimated and forged temperature of the worst zone, thin lines for the other zones, and the reference."""
    zone, n = worst_zone(scene, rows, config), config.num_zones
    true, estimated, read = temperatures_of(rows, zone, config)
    acted = rows[:, STEP] > 0
    forged = acted & (rows[:, STEP] >= scene.onset)
    read = read[:, scene.compromised[zone::n]]
    everything = rows[:, ZONES : ZONES + n]
    plot = Plot(box, *range_of(everything, np.append(estimated[acted], read[forged]), config))
    x = times(plot, rows[:, STEP], config)
    draw_panel(canvas, plot)
    draw_title(canvas, plot, f"Zone {zone + 1}, the worst so far: temperature (°C)")
    draw_onset(canvas, scene, plot, config)
    if len(rows) > 1:
        for other in everything.T:
            canvas.path(plot.points(x, other), WALL)
    draw_level(canvas, plot, config.reference_c, MUTED)
    for values in read.T:
        draw_dots(canvas, plot.points(x[forged], values[forged]), tint(FALSE, 0.8))
    decided = times(plot, rows[acted, STEP] - 1, config)
    draw_dots(canvas, plot.points(decided, estimated[acted]), ESTIMATE)
    draw_curve(canvas, plot.points(x, true), TRUE)
    canvas.circle(plot.points(x[-1:], true[-1:])[0], 3.5, TRUE)
    draw_edge(canvas, plot)


def draw_residuals(canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray, config: HvacConfig) -> None:
    """Between which values the mean residuals of intact and of flawed sets lie, that of the chosen set, and eps."""
    left, top, width, _ = plot.box
    draw_panel(canvas, plot)
    draw_title(canvas, plot, "Mean residuals of intact and flawed sets (C²)")
    canvas.text(f"threshold {config.threshold_c2:.3g}", (left + width, top - 7), INK, SMALL, align=1)
    draw_onset(canvas, scene, plot, config)
    x = times(plot, rows[:, STEP], config)
    for low, high, color in ((FLAWED_LOW, FLAWED_HIGH, FALSE), (INTACT_LOW, INTACT_HIGH, TRUE)):
        known = ~np.isnan(rows[:, low])
        if known.sum() > 1:
            bottom, ceiling = (plot.points(x[known], rows[known, column]) for column in (low, high))
            canvas.polygon([*bottom, *ceiling[::-1]], tint(color, 0.25))
            canvas.path(bottom, color)
            canvas.path(ceiling, color)
    draw_level(canvas, plot, config.threshold_c2, INK)
    if scene.ready and 0 < scene.choice <= len(scene.mean_residual):
        canvas.circle(plot.points(x[-1:], scene.mean_residual[scene.choice - 1 : scene.choice])[0], 4.0, ESTIMATE)
    if not scene.ready:
        note = f"none before {clock(config.window_steps, config)} h, when the observer's window is full"
        canvas.text(note, (left + width / 2, top + 14), MUTED, SMALL, align=0.5)
    draw_edge(canvas, plot)


def draw_impact(canvas: Canvas, scene: Scene, plot: Plot, rows: FloatArray, config: HvacConfig) -> None:
    """A_impact so far, and the time below."""
    draw_panel(canvas, plot)
    draw_title(canvas, plot, "A_impact so far (C²)")
    draw_onset(canvas, scene, plot, config)
    draw_curve(canvas, plot.points(times(plot, rows[:, STEP], config), rows[:, IMPACT]), DAMAGE)
    draw_edge(canvas, plot)
    _, top, _, height = plot.box
    for step in marked_steps(config):
        x = float(times(plot, np.array(step), config))
        canvas.text(clock(step, config), (x, top + height + 8), MUTED, SMALL, align=step / (config.num_steps - 1))


def marked_steps(config: HvacConfig) -> list[float]:
    """Steps at which the time is written: at most six, at round times."""
    last_minute = (config.num_steps - 1) * config.step_s / 60.0
    days = DAY_MINUTES * math.ceil(last_minute / DAY_MINUTES / TIME_MARKS)
    pitch = next((minutes for minutes in MINUTES if minutes * TIME_MARKS >= last_minute), days)
    return [minute * 60.0 / config.step_s for minute in range(0, math.floor(last_minute) + 1, pitch)]


def draw_onset(canvas: Canvas, scene: Scene, plot: Plot, config: HvacConfig) -> None:
    """A line where the attack begins, once it has."""
    if scene.step >= scene.onset:
        x = float(times(plot, np.array(scene.onset), config))
        canvas.box((x, plot.box[1], 1, plot.box[3]), FALSE)


def times(plot: Plot, step: FloatArray, config: HvacConfig) -> FloatArray:
    """Pixels of steps."""
    left, _, width, _ = plot.box
    return np.asarray(left + ROOM + step / (config.num_steps - 1) * (width - 2 * ROOM))
