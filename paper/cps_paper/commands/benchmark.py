"""`cps-envs reproduce benchmark`: the declared meetings of problems, beside the paper's numbers."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.arena.store import Store
from cps_agents.commands.options import (
    MEETINGS,
    AsJson,
    AtCluster,
    Fresh,
    Html,
    Jobs,
    Meetings,
    OfPart,
    conclude,
    kept,
    workers,
)
from cps_agents.console import err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import alone_in, write_figure, write_json, write_text
from cps_agents.machine import describe
from cps_agents.part import Unfinished
from cps_agents.progress import Progress
from cps_agents.report.report import PAPER, Report, write_report
from cps_agents.sheet import Sheet
from cps_agents.workers import Where
from cps_envs import PROBLEMS, find_problem
from cps_paper.benchmark.report import agreement, document, heat_maps, markdown, rows_as_csv, tables
from cps_paper.benchmark.schedule import Benchmark
from cps_paper.benchmark.suite import BenchmarkOutcome, compile_kernels, find_benchmark, run_benchmark, select

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
    cluster: AtCluster = None,
    part: OfPart = None,
    fresh: Fresh = False,
    as_json: AsJson = False,
) -> None:
    """Play every computed attacker against every computed defender, beside the paper's numbers.

    A problem of your own is played in each of its presets, by all policies that can play it.

    Press Ctrl-C at any time: finished games are kept, and the same command
    continues. They are played again when code, version or network changes.
    """
    named = list(problem or PROBLEMS)
    for name in named:
        find_problem(name)
    every = list(map(find_benchmark, named))
    if show:
        if cluster is not None or part is not None:
            raise CommandError("a list is no work to divide: leave --cluster and --part out")
        _list_tables(every)
        return
    parts = {"tables": table or [], "attackers": attacker or [], "defenders": defender or []}
    chosen = select(every, **parts, quick=quick, full=full)
    store, where = kept(meetings, fresh=fresh, part=part), workers(jobs, cluster)
    with alone_in(folder) if part is None else nullcontext():  # parts that end at once write the same
        started = time.monotonic()
        outcomes = []
        for outcome in _outcomes(chosen, store, where):
            outcomes.append(outcome)
            if not as_json:
                _show(outcome)
        wall_s = time.monotonic() - started
        found = document(outcomes, describe(), wall_s)
        files = _write(outcomes, found, folder)
        if html is not None:
            sheets = [sheet for each in outcomes for sheet in tables(each)]
            files.append(write_report(Report(sheets=sheets, about_sheets=PAPER), html))
    if as_json:
        print_json(found)
    left = not (full or table) and any(table.only_full for each in every for table in each.tables)
    more = "--full plays the other tables, too." if left else ""
    conclude(files, store, f"{wall_s:.0f} s.", more)
    if quick:
        err().print("--quick: few episodes; these are no results.")


def _list_tables(benchmarks: Sequence[Benchmark]) -> None:
    rows = [
        (each.problem, table.name, table.title, "--full" if table.only_full else "")
        for each in benchmarks
        for table in each.tables
    ]
    out().print(Sheet("Tables", ("problem", "table", "title", "only with"), rows, left=4))


def _outcomes(benchmarks: Sequence[Benchmark], store: Store, where: Where) -> Iterator[BenchmarkOutcome]:
    """Each problem's as soon as it is there."""
    with Progress("kernels", 1) as progress:
        compile_kernels(benchmarks, store, where, progress.report)
    missing = 0
    for each in benchmarks:
        try:
            with Progress(each.problem, 1) as progress:
                yield run_benchmark(each, store, workers=where, report=progress.report)
        except Unfinished as others:  # this part goes on with the next problem
            missing += others.missing
    if missing:
        raise Unfinished(store.part, "meetings", missing)


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
