"""Gaps, detectors and damage in columns: vehicle by vehicle, and between them pair by pair."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.bars import draw_bar, draw_value
from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.palette import INK, MUTED, WHITE, Color, darker, tint
from cps_envs.core.picture.plot import SMALL, Plot, draw_edge, draw_level, draw_panel, draw_title
from cps_envs.rogue.picture.palette import AHEAD, ALARM, ATTACKER, BEHIND, DAMAGE, LAW_COLORS, OTHER, WANTED
from cps_envs.rogue.picture.scene import Scene

NARROWEST_NUMBERED = 36  # pixels of a column, below which values are not written
SHARE = 0.4  # of a column's width that a bar takes
WIDE_BAR, WIDEST_BAR = 25, 28  # pixels; numbers fit into the wide ones


def pair_color(scene: Scene, pair: int) -> Color:
    """The colour of a pair: those with the attacker stand out."""
    return {scene.attacker: AHEAD, scene.attacker - 1: BEHIND}.get(pair, OTHER)


def draw_gaps(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """The gap of each pair, and ticks beside it where a separation has grown and the gap is to follow."""
    draw_panel(canvas, plot, bands(scene, plot))
    draw_level(canvas, plot, scene.desired_gap_m, MUTED)
    end, half = draw_title(canvas, plot, "Gap of each pair (m)"), bar_width(scene, plot) / 2
    for pair, gap in enumerate(scene.gap.tolist()):
        draw_pair(canvas, scene, plot, pair, gap, pair_color(scene, pair) if gap >= 0 else DAMAGE)
        if (growth := wanted_growth(scene, pair)) > 0:
            x, y, length = pair_x(scene, plot, pair), plot.y(scene.desired_gap_m + growth), 0.7 * half
            for left in (x - half - length, x + half):
                canvas.box((left, round(y) - 1, length, 3), WANTED)
    if scene.growth.any():
        canvas.text("wanted after growth", (end + 9, plot.box[1] - 7), WANTED, SMALL)
    draw_edge(canvas, plot)


def wanted_growth(scene: Scene, pair: int) -> float:
    """What the vehicles of a pair that follow one another add to the separation sigma, m."""
    behind = float(scene.growth[pair]) if scene.law[pair] == "front" else 0.0
    ahead = float(scene.growth[pair + 1]) if scene.law[pair + 1] == "rear" else 0.0
    return max(behind, ahead)


def draw_detectors(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """The detectors of each intact vehicle, the rear one left of the front one; yellow where it raised the alarm."""
    draw_panel(canvas, plot, bands(scene, plot))
    draw_title(canvas, plot, "Rear and front detector of each vehicle (share of the alarm threshold)")
    width = bar_width(scene, plot) / 2
    for i, (front, rear) in enumerate((scene.detector / scene.alarm_threshold).tolist()):
        x = vehicle_x(scene, plot, i)
        for value, left, side in ((rear, x - width - 1, -1), (front, x + 1, 1)):
            if value > 0:
                draw_bar(canvas, plot, left, value, ALARM if scene.alarm[i] == side else OTHER, width)
    draw_level(canvas, plot, 1.0, darker(ALARM))
    draw_edge(canvas, plot)


def draw_damage(canvas: Canvas, scene: Scene, plot: Plot, unit: str) -> None:
    """The damage of each pair so far."""
    draw_panel(canvas, plot, bands(scene, plot))
    draw_title(canvas, plot, f"Damage of each pair so far ({unit})")
    for pair, damage in enumerate(scene.damage.tolist()):
        if damage > 0:
            draw_pair(canvas, scene, plot, pair, damage, DAMAGE)
    draw_edge(canvas, plot)


def draw_pair(canvas: Canvas, scene: Scene, plot: Plot, pair: int, value: float, color: Color) -> None:
    """A pair's bar between its vehicles' columns."""
    x, width = pair_x(scene, plot, pair), bar_width(scene, plot)
    draw_bar(canvas, plot, x - width / 2, value, color, width)
    if plot.box[2] / len(scene.position) >= NARROWEST_NUMBERED:
        inside = value > plot.high and color in (AHEAD, BEHIND) and width >= WIDE_BAR
        draw_value(canvas, plot, x, value, WHITE if inside else INK)


def draw_numbers(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """Below a panel each vehicle's number in the colour of its law, and how much its separation has grown."""
    _, top, _, height = plot.box
    pitch = plot.box[2] / len(scene.position)
    for i, law in enumerate(scene.law):
        x, y, color = vehicle_x(scene, plot, i), top + height + 10, LAW_COLORS[law]
        badge = min(pitch - 3, 34)
        canvas.box((x - badge / 2, y - 7, badge, 14), color, radius=3)
        canvas.text(str(i + 1), (x, y + 1), WHITE if i == scene.attacker else INK, SMALL, align=0.5)
        if scene.growth[i] > 0:
            unit = " m" if pitch >= NARROWEST_NUMBERED else ""
            canvas.text(f"+{scene.growth[i]:g}{unit}", (x, y + 15), MUTED, SMALL - (0 if unit else 2), align=0.5)


def vehicle_x(scene: Scene, plot: Plot, vehicle: int) -> float:
    """Middle of a vehicle's column in pixels."""
    return plot.box[0] + (vehicle + 0.5) * plot.box[2] / len(scene.position)


def pair_x(scene: Scene, plot: Plot, pair: int) -> float:
    """Middle between the columns of a pair in pixels."""
    return vehicle_x(scene, plot, pair) + plot.box[2] / len(scene.position) / 2


def bar_width(scene: Scene, plot: Plot) -> float:
    """Width in pixels of a bar."""
    return float(np.clip(round(SHARE * plot.box[2] / len(scene.position)), 4, WIDEST_BAR))


def bands(scene: Scene, plot: Plot) -> list[tuple[Box, Color]]:
    """The attacker's column."""
    left, top, width, height = plot.box
    pitch = width / len(scene.position)
    return [((left + scene.attacker * pitch, top, pitch, height), tint(ATTACKER, 0.13))]
