"""A reproduced chapter on a console, and its figures as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cps_agents.files import write_figure, write_text

if TYPE_CHECKING:
    from rich.console import Console

    from cps_agents.table import Table as Shown
    from cps_baselines.reproduction.chapter import Reproduction
    from cps_baselines.reproduction.exhibit import Table

COLORS = {
    "match": "green",
    "reproduced": "green",
    "near": "yellow",
    "partly": "yellow",
    "miss": "red",
    "not reproduced": "red",
    "not evaluated": "dim",
}


def render(console: Console, found: Reproduction[Any]) -> None:
    """Print all tables with their notes, then what is not reproduced and why."""
    for table in found.tables():
        console.print(_table(table))
        for note in table.notes:
            console.print(note, style="dim", markup=False)
        console.print()
    for paragraph in found.closing():
        console.print(paragraph, markup=False)
        console.print()


def draw(found: Reproduction[Any], folder: Path) -> list[Path]:
    """Write the figures as PNG files; returns their paths."""
    paths = []
    for name, figure in found.figures():
        paths.append(folder / f"{name}.png")
        write_figure(paths[-1], figure)
    return paths


def write_sheets(found: Reproduction[Any], folder: Path) -> list[Path]:
    """Write the tables as CSV files; returns their paths."""
    paths = []
    for name, text in found.sheets():
        paths.append(folder / f"{name}.csv")
        write_text(paths[-1], text)
    return paths


def _table(table: Table) -> Shown:
    from cps_agents.table import Table as Shown
    from cps_agents.table import styled

    rows = [[styled(text, COLORS[text]) if text in COLORS else text for text in row] for row in table.rows]
    return Shown(table.title, table.headings, rows, left=table.left, breaks=table.breaks)
