"""Gaps, detectors and damage in columns: vehicle by vehicle, and between them pair by pair."""

from __future__ import annotations

from functools import partial

from cps_envs.core.picture.canvas import SMALL, Box, Canvas
from cps_envs.core.picture.marks import WIDE_BAR, Bar, BarValue, LevelLine, Mark
from cps_envs.core.picture.palette import DAMAGE, INK, MUTED, WHITE, Color, darker, tint
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import Plot
from cps_envs.rogue.picture.palette import AHEAD, ALARM, ATTACKER, BEHIND, LAW_COLORS, OTHER, WANTED
from cps_envs.rogue.picture.scene import Scene

BAR = 0.4  # of a column's width
NARROWEST_NUMBERED = 36  # pixels of a column, below which values are not written


def gaps(plot: Plot, scene: Scene) -> Panel:
    """The gap of each pair, and ticks beside it where a separation has grown and the gap is to follow."""
    colors = {pair: color for i in scene.seized for pair, color in ((i - 1, BEHIND), (i, AHEAD))}  # they stand out
    marks: list[Mark] = [LevelLine(scene.desired_gap_m, MUTED)]
    for pair, gap in enumerate(scene.gap.tolist()):
        marks += pair_marks(plot, pair, gap, colors.get(pair, OTHER) if gap >= 0 else DAMAGE)
        if (growth := wanted_growth(scene, pair)) > 0:
            marks.append(partial(draw_wanted, pair, scene.desired_gap_m + growth))
    words = [("wanted after growth", WANTED)] if scene.growth.any() else []
    return Panel(plot, "Gap of each pair (m)", marks, words=words, bands=bands(plot, scene))


def wanted_growth(scene: Scene, pair: int) -> float:
    """What the vehicles of a pair that follow one another add to the separation sigma, m."""
    behind = float(scene.growth[pair]) if scene.law[pair] == "front" else 0.0
    ahead = float(scene.growth[pair + 1]) if scene.law[pair + 1] == "rear" else 0.0
    return max(behind, ahead)


def draw_wanted(pair: int, gap_m: float, canvas: Canvas, plot: Plot) -> None:
    """Ticks on both sides of a pair's bar."""
    x, half = plot.between(pair), plot.bar(BAR) / 2
    for left in (x - 1.7 * half, x + half):
        canvas.box((left, round(plot.y(gap_m)) - 1, 0.7 * half, 3), WANTED)


def detectors(plot: Plot, scene: Scene) -> Panel:
    """The detectors of each intact vehicle, the rear one left of the front one; yellow where it raised the alarm."""
    width, marks = plot.bar(BAR) / 2, list[Mark]()
    for i, (front, rear) in enumerate((scene.detector / scene.config.alarm_threshold).tolist()):
        x = plot.middle(i)
        for value, left, side in ((rear, x - width - 1, -1), (front, x + 1, 1)):
            if value > 0:
                marks.append(Bar(left, width, value, ALARM if scene.alarm[i] == side else OTHER))
    title = "Rear and front detector of each vehicle (share of the alarm threshold)"
    return Panel(plot, title, [*marks, LevelLine(1.0, darker(ALARM))], bands=bands(plot, scene))


def damages(plot: Plot, scene: Scene, unit: str) -> Panel:
    """The damage of each pair so far; below, the vehicles' numbers."""
    hurt = [(pair, damage) for pair, damage in enumerate(scene.damage.tolist()) if damage > 0]
    marks = [mark for pair, damage in hurt for mark in pair_marks(plot, pair, damage, DAMAGE)]
    title = f"Damage of each pair so far ({unit})"
    return Panel(plot, title, [*marks, partial(draw_numbers, scene)], bands=bands(plot, scene))


def pair_marks(plot: Plot, pair: int, value: float, color: Color) -> list[Mark]:
    """A pair's bar between its vehicles' columns, and its value where there is room."""
    width = plot.bar(BAR)
    bar = Bar(plot.between(pair) - width / 2, width, value, color)
    inside = value > plot.high and color in (AHEAD, BEHIND) and width >= WIDE_BAR
    return [bar, BarValue(bar, WHITE if inside else INK)] if plot.pitch >= NARROWEST_NUMBERED else [bar]


def draw_numbers(scene: Scene, canvas: Canvas, plot: Plot) -> None:
    """Below a panel each vehicle's number in the colour of its law, and how much its separation has grown."""
    y = plot.box[1] + plot.box[3] + 10
    badge, wide = min(plot.pitch - 3, 34), plot.pitch >= NARROWEST_NUMBERED
    for i, law in enumerate(scene.law):
        x = plot.middle(i)
        canvas.box((x - badge / 2, y - 7, badge, 14), LAW_COLORS[law], radius=3)
        canvas.text(str(i + 1), (x, y + 1), WHITE if scene.rogue[i] else INK, SMALL, align=0.5)
        if scene.growth[i] > 0:
            unit, size = (" m", SMALL) if wide else ("", SMALL - 2)
            canvas.text(f"+{scene.growth[i]:g}{unit}", (x, y + 15), MUTED, size, align=0.5)


def bands(plot: Plot, scene: Scene) -> list[tuple[Box, Color]]:
    """The attacker's columns."""
    return [(plot.column(i), tint(ATTACKER, 0.13)) for i in scene.seized]
