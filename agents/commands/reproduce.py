"""`cps-envs reproduce`: what the dissertation prints, computed by our code and put beside it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.console import err, out, print_json

if TYPE_CHECKING:
    from rich.console import Console

    from baselines.disbanding.reproduction.chapter import Reproduction
    from baselines.reproduction.block import Block

REGRESSION = 1  # exit code
PERCENT, DPI = 100, 130
COLORS = {
    "match": "green",
    "reproduced": "green",
    "near": "yellow",
    "partly": "yellow",
    "miss": "red",
    "not reproduced": "red",
    "not evaluated": "dim",
}
PART = "Only this part: 2.2, 2.3, 2.1fig, 2.3fig, ga or claims; may be repeated."

app = typer.Typer(no_args_is_help=True)


@app.callback()
def reproduce() -> None:
    """Compute the tables, figures and claims of a chapter and put them beside what the paper prints."""


@app.command("ch2")
def chapter_2(
    table: Annotated[list[str] | None, typer.Option(metavar="PART", help=PART)] = None,
    interpretation: Annotated[str, typer.Option(help="How to read what the paper leaves open: S0, S1, S2.")] = "S0",
    all_interpretations: Annotated[
        bool, typer.Option("--all-interpretations", help="The baseline under S0, S1 and S2 as well.")
    ] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Leave out long strings, grids and most searches.")] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores if left out.")] = None,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Write the figures there as PNG files.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output, nothing else on stdout.")] = False,
) -> None:
    """Platoon disbanding: Tables 2.2 and 2.3, Figs. 2.1 and 2.3, the optimal attacks and every claim of the text.

    Cells that differ from the paper are findings and do not fail. The exit code is 1 when our own numbers left the
    reference values of the specification, which means that the simulation has changed.
    """
    from agents.machine import available_cores, describe
    from agents.progress import Progress
    from baselines.disbanding.reproduction.chapter import reproduce_chapter
    from baselines.disbanding.reproduction.selection import chosen
    from baselines.reproduction.figures import require_matplotlib

    parts = chosen(table or [])
    if plot is not None:
        require_matplotlib()
    started = time.monotonic()
    with Progress("chapter 2", PERCENT) as progress:
        found = reproduce_chapter(
            parts,
            interpretation,
            jobs=jobs or available_cores(),
            quick=quick,
            all_interpretations=all_interpretations,
            report=lambda share, label: progress.update(int(PERCENT * share), label),
        )
    wall_s = time.monotonic() - started
    files = [] if plot is None else _draw(found, plot)
    if as_json:
        print_json({**found.document(), "files": list(map(str, files)), "wall_s": wall_s, **describe()})
    else:
        _print(out(), found)
    written = f" Written: {', '.join(map(str, files))}" if files else ""
    err().print(f"{wall_s:.0f} s.{written}", soft_wrap=True)
    if not found.passed:
        raise typer.Exit(REGRESSION)


def _draw(found: Reproduction, folder: Path) -> list[Path]:
    """The figures of the parts asked for."""
    from agents.files import replacing
    from baselines.disbanding.reproduction import plot_2_1, plot_2_3

    paths = []
    for part, name, draw in (("2.1fig", "figure_2_1", plot_2_1.draw), ("2.3fig", "figure_2_3", plot_2_3.draw)):
        if part in found.parts:
            path = folder / f"{name}.png"
            with replacing(path) as draft:
                draw(found.evidence).savefig(draft, dpi=DPI)
            paths.append(path)
    return paths


def _print(console: Console, found: Reproduction) -> None:
    for block in found.blocks():
        console.print(_table(block))
        for note in block.notes:
            console.print(note, style="dim", markup=False)
        console.print()
    for paragraph in found.closing():
        console.print(paragraph, markup=False)
        console.print()


def _table(block: Block) -> Any:
    from agents.console import make_table

    rows = [[_colored(value) for value in row] for row in block.rows]
    table = make_table(block.title, block.columns, rows, left=block.left)
    for row in block.breaks:
        table.rows[row].end_section = True
    return table


def _colored(value: str) -> str:
    from rich.markup import escape

    color = COLORS.get(value)
    return escape(value) if color is None else f"[{color}]{value}[/]"
