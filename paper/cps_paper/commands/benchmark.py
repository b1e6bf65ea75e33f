"""`cps-envs reproduce benchmark`: the declared meetings of problems, beside the paper's numbers."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.arena.store import Store
from cps_agents.commands.options import MEETINGS, AsJson, Fresh, Html, Jobs, Meetings, conclude
from cps_agents.console import err, out, print_json
from cps_agents.files import alone_in, write_figure, write_json, write_text
from cps_agents.machine import available_cores, describe
from cps_agents.progress import Progress
from cps_agents.report.report import PAPER, Report, sheets_of_printed, write_report
from cps_agents.table import Table
from cps_envs import PROBLEMS, find_problem
from cps_paper.benchmark.report import agreement, document, heat_maps, markdown, rows_as_csv, tables
from cps_paper.benchmark.suite import (
    BenchmarkChoice,
    BenchmarkOutcome,
    compile_kernels,
    find_benchmark,
    run_benchmark,
    select,
)

Names = list[str] | None


def benchmark(
    problem: Annotated[Names, typer.Argument(help="Problems, such as hvac; default: all four.")] = None,
    table: Annotated[Names, typer.Option(help="Compute only this table (see --list); may be repeated.")] = None,
    attacker: Annotated[Names, typer.Option(help="Play only this attacker; may be repeated.")] = None,
    defender: Annotated[Names, typer.Option(help="Play only this defender; may be repeated.")] = None,
    full: Annotated[bool, typer.Option("--full", help="Compute every table, not only the main ones.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Take a quick look, with few episodes; no result.")] = False,
    show: Annotated[bool, typer.Option("--list", help="Print the tables and stop.")] = False,
    folder: Annotated[Path, typer.Option("--out", help="Write files to this folder.")] = Path("results"),
    html: Html = None,
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    fresh: Fresh = False,
    as_json: AsJson = False,
) -> None:
    """Play every computed attacker against every computed defender, beside the paper's numbers.

    A problem of your own is played in each of its presets, by all policies that can play it.

    Press Ctrl-C at any time: finished games are kept, and the same command
    continues. They are played again when code, version or network changes.
    """
    names = list(problem or PROBLEMS)
    for name in names:
        find_problem(name)
    store, workers = Store(meetings, fresh=fresh), jobs or available_cores()
    choice = BenchmarkChoice(table or [], attacker or [], defender or [], quick, full)
    if show:
        _list_settings(names)
        return
    chosen = select([find_benchmark(name) for name in names], choice)
    with alone_in(folder):
        _play(chosen, choice, store, folder, html, workers, as_json)
    if quick:
        err().print("--quick: few episodes and short searches; these are no results.")


def _list_settings(names: Sequence[str]) -> None:
    rows = [
        (name, setting.name, setting.title, "--full" if setting.only_full else "")
        for name in names
        for setting in find_benchmark(name).settings
    ]
    out().print(Table("Tables", ("problem", "table", "title", "only with"), rows, left=4))


def _play(
    benchmarks: Sequence[Any],
    choice: BenchmarkChoice,
    store: Store,
    folder: Path,
    html: Path | None,
    workers: int,
    as_json: bool,
) -> None:
    """Show each problem's tables as soon as they are there."""
    started = time.monotonic()
    outcomes = []
    for outcome in _outcomes(benchmarks, choice, store, workers):
        outcomes.append(outcome)
        if not as_json:
            _show(outcome)
    wall_s = time.monotonic() - started
    found = document(outcomes, describe(), wall_s)
    files = _write(outcomes, found, folder)
    files += [] if html is None else [_page([table for each in outcomes for table in tables(each)], PAPER, html)]
    if as_json:
        print_json(found)
    reused = sum(outcome.played.reused for outcome in outcomes)
    left = not (choice.full or choice.tables) and any(
        setting.only_full for each in benchmarks for setting in find_benchmark(each.problem).settings
    )
    more = "--full plays the other tables, too." if left else ""
    conclude(files, reused, f"{wall_s:.0f} s.", more)


def _outcomes(
    benchmarks: Sequence[Any], choice: BenchmarkChoice, store: Store, workers: int
) -> Iterator[BenchmarkOutcome]:
    with Progress("kernels", 1) as progress:
        compile_kernels(benchmarks, store, workers, progress.report)
    for each in benchmarks:
        with Progress(each.problem, 1) as progress:
            yield run_benchmark(each, store, workers=workers, quick=choice.quick, report=progress.report)


def _write(outcomes: Sequence[BenchmarkOutcome], found: dict[str, Any], folder: Path) -> list[Path]:
    files = [folder / f"benchmark.{suffix}" for suffix in ("json", "csv", "md")]
    write_json(files[0], found)
    write_text(files[1], rows_as_csv(outcomes))
    made = f"`{found['command']}`, {found['cpu']}, {found['cores']} cores, {found['wall_s']:.0f} s"
    write_text(files[2], "\n".join(["# Benchmark", "", made, "", *map(markdown, outcomes)]))
    for name, figure in (each for outcome in outcomes for each in heat_maps(outcome)):
        files.append(folder / f"{name}.png")
        write_figure(files[-1], figure)
    return files


def _show(outcome: BenchmarkOutcome) -> None:
    console = out()
    for table in tables(outcome):
        console.print(table)
    for note in filter(None, (*outcome.benchmark.notes, agreement(outcome))):
        console.print(note)


def _page(tables: Sequence[Table], about: tuple[str, str], folder: Path) -> Path:
    return write_report(Report(sheets=sheets_of_printed(tables), about_sheets=about), folder)
