"""What every vehicle's sensors report beside the truth, and what it commands, vehicle by vehicle."""

from __future__ import annotations

from cps_envs.core.picture.bars import draw_bar, draw_value
from cps_envs.core.picture.canvas import Box, Canvas
from cps_envs.core.picture.palette import INK, MUTED, WHITE, Color, tint
from cps_envs.core.picture.plot import SMALL, Plot, draw_edge, draw_level, draw_panel, draw_title
from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.picture.palette import DAMAGE, FALSE, REPLACED, TARGET, TRUE
from cps_envs.fdi.picture.scene import Scene

WIDEST_BAR = 28  # pixels
WIDE_BAR = 25  # pixels, from which on numbers of neighbours do not meet
NARROWEST_NUMBERED = 34  # pixels of a column, below which values are not written


def draw_gaps(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """True gaps, and what attacked range sensors report."""
    n = len(scene.gap)
    draw_panel(canvas, plot, bands(scene, plot, 0))
    draw_level(canvas, plot, scene.desired_gap_m, MUTED)
    draw_title(canvas, plot, "Gap ahead of each vehicle (m)")
    values = (scene.gap, scene.reported_gap, scene.used_gap)
    for i in range(n):
        draw_reading(canvas, scene, plot, i, i, values)
    draw_edge(canvas, plot)


def draw_closing_speeds(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """True closing speeds, and what attacked range-rate sensors report."""
    n = len(scene.gap)
    draw_panel(canvas, plot, bands(scene, plot, n))
    draw_title(canvas, plot, "Closing speed of each vehicle (m/s)")
    values = (scene.closing_speed, scene.reported_closing_speed, scene.used_closing_speed)
    for i in range(n):
        draw_reading(canvas, scene, plot, i, n + i, values)
    draw_edge(canvas, plot)


def draw_commands(canvas: Canvas, scene: Scene, plot: Plot, config: FdiConfig) -> None:
    """Commanded accelerations between their limits; red beyond."""
    low, high = config.min_acceleration_mps2, config.max_acceleration_mps2
    limits = f", limits {low:g} and {high:g}" if config.limit_commands else ""
    draw_panel(canvas, plot, bands(scene, plot, None))
    draw_title(canvas, plot, f"Commanded acceleration (m/s²){limits}")
    width = bar_width(scene, plot)
    for i, command in enumerate(scene.command.tolist()):
        beyond = config.limit_commands and not low - SLACK <= command <= high + SLACK
        draw_bar(canvas, plot, centre(scene, plot, i) - width / 2, command, DAMAGE if beyond else TRUE, width)
    if config.limit_commands:
        draw_level(canvas, plot, low, DAMAGE)
        draw_level(canvas, plot, high, DAMAGE)
    draw_edge(canvas, plot)


def draw_numbers(canvas: Canvas, scene: Scene, plot: Plot) -> None:
    """The vehicles' numbers below a panel, the target's on a badge."""
    _, top, _, height = plot.box
    for i in range(len(scene.gap)):
        label, x, y = str(i + 1), centre(scene, plot, i), top + height + 9
        target = i + 1 == scene.target
        if target:
            badge = canvas.text_width(label, WHITE, SMALL) + 10
            canvas.box((x - badge / 2, y - 7, badge, 13), TARGET, radius=3)
        canvas.text(label, (x, y), WHITE if target else MUTED, SMALL, align=0.5)


def centre(scene: Scene, plot: Plot, vehicle: int) -> float:
    """Middle of a vehicle's column in pixels."""
    return plot.box[0] + (vehicle + 0.5) * plot.box[2] / len(scene.gap)


def bar_width(scene: Scene, plot: Plot) -> float:
    """Width in pixels of each of two bars that stand in a column."""
    return min(round(0.32 * plot.box[2] / len(scene.gap)), WIDEST_BAR)


def bands(scene: Scene, plot: Plot, first: int | None) -> list[tuple[Box, Color]]:
    """The target's column, and those whose sensors, from index `first` on, are attacked."""
    left, top, width, height = plot.box
    n = len(scene.gap)
    pitch = width / n
    shown = []
    for i in range(n):
        attacked = first is not None and bool(scene.attacked[first + i])
        if attacked or i + 1 == scene.target:
            color = tint(FALSE, 0.14) if attacked else tint(TARGET, 0.08)
            shown.append(((left + i * pitch, top, pitch, height), color))
    return shown


def draw_reading(
    canvas: Canvas, scene: Scene, plot: Plot, vehicle: int, sensor: int, values: tuple[FloatArray, ...]
) -> None:
    """The bar of the truth; beside it that of an attacked sensor, and a line at what was used instead."""
    true, reported, used = (float(value[vehicle]) for value in values)
    x, width, attacked = centre(scene, plot, vehicle), bar_width(scene, plot), bool(scene.attacked[sensor])
    numbered = plot.box[2] / len(scene.gap) >= NARROWEST_NUMBERED
    left = x - width - 1 if attacked else x - width / 2
    draw_bar(canvas, plot, left, true, TRUE, width)
    if attacked:
        draw_bar(canvas, plot, x + 1, reported, FALSE, width, hollow=True)
    if not scene.trusted[sensor]:
        y, reach = round(plot.y(used)), width + 4
        canvas.box((x - reach, y - 1, 2 * reach, 3), REPLACED, radius=1)
    if numbered and (not attacked or width >= WIDE_BAR):
        draw_value(canvas, plot, left + width / 2, true, INK)
    if numbered and attacked and scene.trusted[sensor]:
        draw_value(canvas, plot, x + 1 + width / 2, reported, FALSE)
