"""A reproduced chapter on a console, and its figures as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cps_agents.files import write_figure

if TYPE_CHECKING:
    from rich.console import Console

    from cps_agents.reproduction.chapter import Reproduction
    from cps_baselines.reproduction.block import Block

COLORS = {
    "match": "green",
    "reproduced": "green",
    "near": "yellow",
    "partly": "yellow",
    "miss": "red",
    "not reproduced": "red",
    "not evaluated": "dim",
}


def render(console: Console, found: Reproduction) -> None:
    """Print all tables with their notes, then what is not reproduced and why."""
    for block in found.blocks():
        console.print(_table(block))
        for note in block.notes:
            console.print(note, style="dim", markup=False)
        console.print()
    for paragraph in found.closing():
        console.print(paragraph, markup=False)
        console.print()


def draw(found: Reproduction, folder: Path) -> list[Path]:
    """Write the figures as PNG files; returns their paths."""
    paths = []
    for name, figure in found.figures():
        paths.append(folder / f"{name}.png")
        write_figure(paths[-1], figure)
    return paths


def _table(block: Block) -> Any:
    from cps_agents.console import make_table

    rows = [[_colored(value) for value in row] for row in block.rows]
    table = make_table(block.title, block.headings, rows, left=block.left)
    for row in block.breaks:
        table.rows[row].end_section = True
    return table


def _colored(value: str) -> str:
    from rich.markup import escape

    color = COLORS.get(value)
    return escape(value) if color is None else f"[{color}]{value}[/]"
