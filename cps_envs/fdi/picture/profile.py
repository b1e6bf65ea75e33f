"""What every vehicle's sensors report beside the truth, and what it commands, vehicle by vehicle."""

from __future__ import annotations

from functools import partial

from cps_envs.core.picture.canvas import SMALL, Box, Canvas
from cps_envs.core.picture.marks import WIDE_BAR, Bar, BarValue, LevelLine, Mark
from cps_envs.core.picture.palette import BELIEVED, DAMAGE, FALSE, INK, MUTED, TRUE, WHITE, Color, tint
from cps_envs.core.picture.panel import Panel
from cps_envs.core.picture.plot import Plot
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.picture.palette import TARGET
from cps_envs.fdi.picture.scene import Scene

BAR = 0.32  # of a column's width
NARROWEST_NUMBERED = 34  # pixels of a column, below which values are not written


def gaps(plot: Plot, scene: Scene) -> Panel:
    """True gaps, and what attacked range sensors report."""
    desired, marks = LevelLine(scene.config.desired_gap_m, MUTED), sensor_marks(plot, scene, "gap", 0)
    return Panel(plot, "Gap ahead of each vehicle (m)", [desired, *marks], bands=bands(plot, scene, 0))


def closing_speeds(plot: Plot, scene: Scene) -> Panel:
    """True closing speeds, and what attacked range-rate sensors report."""
    first = len(scene.gap)
    marks = sensor_marks(plot, scene, "closing_speed", first)
    return Panel(plot, "Closing speed of each vehicle (m/s)", marks, bands=bands(plot, scene, first))


def commands(plot: Plot, scene: Scene) -> Panel:
    """Commanded accelerations between their limits; red beyond. Below, the vehicles' numbers."""
    config, width, marks = scene.config, plot.bar(BAR), list[Mark]()
    low, high = config.min_acceleration_mps2, config.max_acceleration_mps2
    for i, command in enumerate(scene.command.tolist()):
        beyond = config.limit_commands and not low - SLACK <= command <= high + SLACK
        marks.append(Bar(plot.middle(i) - width / 2, width, command, DAMAGE if beyond else TRUE))
    title = "Commanded acceleration (m/s²)"
    if config.limit_commands:
        title += f", limits {low:g} and {high:g}"
        marks += [LevelLine(low, DAMAGE), LevelLine(high, DAMAGE)]
    return Panel(plot, title, [*marks, partial(draw_numbers, scene.target)], bands=bands(plot, scene, None))


def sensor_marks(plot: Plot, scene: Scene, name: str, first: int) -> list[Mark]:
    """Bars of the truth; beside them those of attacked sensors, from index `first` on, and what was used instead."""
    width, numbered, marks = plot.bar(BAR), plot.pitch >= NARROWEST_NUMBERED, list[Mark]()
    for i in range(plot.columns):
        true, reported, used = (float(getattr(scene, f"{seen}{name}")[i]) for seen in ("", "reported_", "used_"))
        x, attacked, trusted = plot.middle(i), bool(scene.attacked[first + i]), bool(scene.trusted[first + i])
        bar = Bar(x - width - 1 if attacked else x - width / 2, width, true, TRUE)
        false = Bar(x + 1, width, reported, FALSE, hollow=True)
        marks += [bar, false] if attacked else [bar]
        if not trusted:
            marks.append(partial(draw_used, x, width + 4, used))
        if numbered and (not attacked or width >= WIDE_BAR):
            marks.append(BarValue(bar, INK))
        if numbered and attacked and trusted:
            marks.append(BarValue(false, FALSE))
    return marks


def draw_used(x: float, reach: float, value: float, canvas: Canvas, plot: Plot) -> None:
    """A line at what was used instead of a reading."""
    canvas.box((x - reach, round(plot.y(value)) - 1, 2 * reach, 3), BELIEVED, radius=1)


def draw_numbers(target: int, canvas: Canvas, plot: Plot) -> None:
    """The vehicles' numbers below a panel, the target's on a badge."""
    y = plot.box[1] + plot.box[3] + 9
    for i in range(plot.columns):
        label, x, targeted = str(i + 1), plot.middle(i), i + 1 == target
        if targeted:
            badge = canvas.text_width(label, WHITE, SMALL) + 10
            canvas.box((x - badge / 2, y - 7, badge, 13), TARGET, radius=3)
        canvas.text(label, (x, y), WHITE if targeted else MUTED, SMALL, align=0.5)


def bands(plot: Plot, scene: Scene, first: int | None) -> list[tuple[Box, Color]]:
    """The target's column, and those whose sensors, from index `first` on, are attacked."""
    shown = []
    for i in range(plot.columns):
        if first is not None and scene.attacked[first + i]:
            shown.append((plot.column(i), tint(FALSE, 0.14)))
        elif i + 1 == scene.target:
            shown.append((plot.column(i), tint(TARGET, 0.08)))
    return shown
