"""What the commands of all chapters share: computing with progress, then tables or JSON, figures, and an exit code."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from agents.console import err, out, print_json

if TYPE_CHECKING:
    from rich.console import Console

    from baselines.reproduction.block import Block
    from baselines.reproduction.evidence import Report

Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores if left out.")]
Folder = Annotated[Path | None, typer.Option(metavar="DIR", help="Write the figures there as PNG files.")]
AsJson = Annotated[bool, typer.Option("--json", help="Machine-readable output, nothing else on stdout.")]

REGRESSION = 1  # exit code
PERCENT = 100
COLORS = {
    "match": "green",
    "reproduced": "green",
    "near": "yellow",
    "partly": "yellow",
    "miss": "red",
    "not reproduced": "red",
    "not evaluated": "dim",
}


class Reproduction(Protocol):
    """What was computed for a chapter."""

    @property
    def passed(self) -> bool:
        """Whether our own numbers are still those of the reference."""
        ...

    def blocks(self) -> Sequence[Block]:
        """Tables for readers."""
        ...

    def closing(self) -> Sequence[str]:
        """Paragraphs that say what is not reproduced, and why."""
        ...

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        ...

    def figures(self) -> Iterator[tuple[str, Any]]:
        """File names without suffix, and matplotlib figures."""
        ...


def show(
    title: str,
    compute: Callable[[int, Report], Reproduction],
    *,
    jobs: int | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Compute with so many processes, reporting progress; print; draw into the folder `plot`; tell the time.

    Raises:
        MissingExtraError: figures are wanted and matplotlib is not installed; nothing has been computed yet.
        typer.Exit: with REGRESSION, after all that, where our numbers have left the reference.
    """
    from agents.machine import available_cores, describe
    from agents.progress import Progress
    from baselines.reproduction.figures import require_matplotlib

    if plot is not None:
        require_matplotlib()
    started = time.monotonic()
    with Progress(title, PERCENT) as progress:
        found = compute(jobs or available_cores(), lambda share, label: progress.update(int(PERCENT * share), label))
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
    from agents.files import write_figure

    paths = []
    for name, figure in found.figures():
        paths.append(folder / f"{name}.png")
        write_figure(paths[-1], figure)
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
