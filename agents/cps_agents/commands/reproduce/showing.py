"""What the commands of all chapters share: computing with progress, then tables or JSON, figures, and an exit code."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.console import err, out, print_json
from cps_agents.machine import available_cores, describe
from cps_agents.progress import Progress

if TYPE_CHECKING:
    from cps_baselines.reproduction.chapter import Reproduction
    from cps_baselines.reproduction.evidence import Report

Jobs = Annotated[int | None, typer.Option(min=1, help="Use so many processes; default: all cores.")]
Folder = Annotated[Path | None, typer.Option(metavar="DIR", help="Write the figures to this folder, as PNG files.")]
Sheets = Annotated[
    Path | None, typer.Option("--csv", metavar="DIR", help="Write the tables to this folder, as CSV files.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else on stdout.")]

REGRESSION = 1  # exit code
PERCENT = 100


def show(
    title: str,
    compute: Callable[[int, Report], Reproduction[Any]],
    *,
    jobs: int | None,
    plot: Path | None,
    sheets: Path | None,
    html: Path | None,
    as_json: bool,
) -> None:
    """Compute with so many processes, reporting progress; print; write figures, tables and a page into folders.

    Raises:
        MissingExtraError: figures are wanted and matplotlib is not installed; nothing has been computed yet.
        typer.Exit: with REGRESSION, after all that, where our numbers have left the reference.
    """
    from cps_agents.report.report import Report, write_report
    from cps_agents.report.sheets import sheets_of
    from cps_agents.reproduction.rendering import draw, render, write_sheets
    from cps_baselines.reproduction.figures import require_matplotlib

    if plot is not None:
        require_matplotlib()
    started = time.monotonic()
    with Progress(title, PERCENT) as progress:
        found = compute(jobs or available_cores(), lambda share, label: progress.update(int(PERCENT * share), label))
    wall_s = time.monotonic() - started
    files = [] if plot is None else draw(found, plot)
    files += [] if sheets is None else write_sheets(found, sheets)
    files += [] if html is None else [write_report(Report(sheets=sheets_of(found.tables()), title=title), html)]
    if as_json:
        print_json({**found.document(), "files": list(map(str, files)), "wall_s": wall_s, **describe()})
    else:
        render(out(), found)
    written = f" Written: {', '.join(map(str, files))}" if files else ""
    err().print(f"{wall_s:.0f} s.{written}", soft_wrap=True)
    if not found.passed:
        raise typer.Exit(REGRESSION)
