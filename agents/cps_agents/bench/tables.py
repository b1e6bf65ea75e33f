"""Rows as tables, and what they are compared with as a sentence."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from cps_agents.bench.measuring import Findings
from cps_agents.bench.row import Row
from cps_agents.sheet import Sheet

Cell: TypeAlias = Callable[[Row], str]
Columns: TypeAlias = Mapping[str, tuple[str, tuple[tuple[str, Cell], ...]]]  # part -> title, columns


def number(key: str, form: str = ",.1f", factor: float = 1.0) -> Cell:
    """A value of a row, times a factor; a dash where there is none."""
    return lambda row: format(factor * row.values[key], form) if key in row.values else "-"


OWN: Columns = {
    "interfaces": (
        "Interfaces: against none",
        (
            ("steps/s", number("steps_per_s", ",.0f")),
            ("us/step", number("step_us", ".3g")),
            ("CartPoles", number("cartpoles", ".3g")),
        ),
    ),
    "added": (
        "What interfaces add to a decision of one environment",
        (
            ("game, us", number("game_us")),
            ("single adds", number("single_us")),
            ("vector adds", number("vector_us")),
        ),
    ),
}


def tables(rows: Sequence[Row], columns_of: Columns = OWN) -> list[object]:
    """A table for each part that was measured, and the reasons of rows without figures below."""
    found: list[object] = []
    for part, (title, columns) in columns_of.items():
        if own := [row for row in rows if row.part == part]:
            cells = [(_label(row), *(cell(row) for _, cell in columns)) for row in own if row.values]
            found.append(Sheet(title, ("", *(name for name, _ in columns)), cells))
            found += [f"{row.name}: {row.note}" for row in own if not row.values]
    return found


def _label(row: Row) -> str:
    return f"{row.name} ({row.note})" if row.note else row.name


def yardsticks(found: Findings, machine: dict[str, Any]) -> str:
    """The yardsticks that everything was measured by, and the machine."""
    lines = [f"{machine['cpu']}, Python {machine['python']}; CPU time of one process, the best of several rounds."]
    lines += [
        f"A step of a single CartPole takes {each.cartpole_us:.1f} us. The simplest vehicle in a compiled loop makes "
        f"{each.updates_per_s / 1e9:.2f}e9 steps/s of seven operations, and a loop of divisions "
        f"{each.divisions_per_s / 1e9:.2f}e9/s."
        for each in found.yardsticks[:1]
    ]
    return "\n".join(lines)
