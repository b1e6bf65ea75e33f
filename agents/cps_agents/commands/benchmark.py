"""`cps-envs benchmark`: the declared meetings of problems, judged against the paper or against the other policies."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.commands.options import MEETINGS, AsJson, Fresh, Html, Jobs, Meetings, conclude
from cps_agents.console import err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import alone_in, write_figure, write_json, write_text
from cps_agents.machine import available_cores, describe
from cps_agents.progress import Progress
from cps_agents.table import Table

if TYPE_CHECKING:
    from cps_agents.arena.store import Store
    from cps_agents.benchmark.suite import Choice, Outcome
    from cps_agents.results.block import Block

Names = list[str] | None
LEARNED = ("Learned policies", "Trained policies, beside what they should reach on seeds that no training has used.")


class Suite(str, Enum):
    """What is played and how it is judged."""

    PAPER = "paper"
    LEARNED = "learned"


def benchmark(
    problem: Annotated[Names, typer.Argument(help="Problems, such as hvac; default: all four.")] = None,
    suite: Annotated[
        Suite, typer.Option(help="Compare with the paper's numbers, or judge learned policies.")
    ] = Suite.PAPER,
    table: Annotated[Names, typer.Option(help="Compute only this table (see --list); may be repeated.")] = None,
    attacker: Annotated[Names, typer.Option(help="Play only this attacker (suite paper); may be repeated.")] = None,
    defender: Annotated[Names, typer.Option(help="Play only this defender (suite paper); may be repeated.")] = None,
    policy: Annotated[Names, typer.Option(help="Also judge zoo:FOLDER (suite learned); may be repeated.")] = None,
    full: Annotated[
        bool, typer.Option("--full", help="Compute every table of suite paper, not only the main ones.")
    ] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Take a quick look, with few episodes; no result.")] = False,
    publish: Annotated[bool, typer.Option("--publish", help="Renew docs/results.md and more (suite learned).")] = False,
    show: Annotated[bool, typer.Option("--list", help="Print the tables and stop.")] = False,
    folder: Annotated[Path, typer.Option("--out", help="Write files to this folder.")] = Path("results"),
    html: Html = None,
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    fresh: Fresh = False,
    as_json: AsJson = False,
) -> None:
    """Play attackers against defenders and judge them.

    Suite `paper` plays every computed attacker against every computed defender,
    beside the paper's numbers. Suite `learned` compares trained policies with
    what they should reach. A problem of your own is played in each of its
    presets, by all policies that can play it.

    Press Ctrl-C at any time: finished games are kept, and the same command
    continues. They are played again when code, version or network changes.
    """
    from cps_agents.arena.store import Store
    from cps_agents.benchmark.suite import Choice, find_benchmark, select
    from cps_agents.results.examination import find_blocks
    from cps_envs import PROBLEMS, find_problem

    if publish and (quick or suite is not Suite.LEARNED):
        raise CommandError("--publish takes --suite learned at full length: leave out --quick")
    names = list(problem or PROBLEMS)
    for name in names:
        find_problem(name)
    store, workers = Store(meetings, fresh=fresh), jobs or available_cores()
    if suite is Suite.LEARNED:
        blocks = find_blocks(names, table or [], policy or [])
        if show:
            _list_blocks(blocks)
            return
        with alone_in(folder):
            _examine(blocks, store, folder, html, workers, quick, publish, as_json)
    else:
        choice = Choice(table or [], attacker or [], defender or [], quick, full)
        if show:
            _list_settings(names)
            return
        chosen = select([find_benchmark(name) for name in names], choice)
        with alone_in(folder):
            _play(chosen, choice, store, folder, html, workers, as_json)
    if quick:
        err().print("--quick: few episodes and short searches; these are no results.")


def _list_settings(names: Sequence[str]) -> None:
    from cps_agents.benchmark.suite import find_benchmark

    rows = [
        (name, setting.name, setting.title, "--full" if setting.only_full else "")
        for name in names
        for setting in find_benchmark(name).settings
    ]
    out().print(Table("Tables", ("problem", "table", "title", "only with"), rows, left=4))


def _list_blocks(blocks: Sequence[Block]) -> None:
    from cps_agents.results.examination import missing_of

    rows = []
    for each in blocks:
        missing = dict.fromkeys(name for names in missing_of(each).values() for name in names)
        rows.append((each.problem, each.name, each.title, "\n".join(missing)))
    table = Table("Tables", ("problem", "table", "title", "missing policies"), rows, left=4)
    out().print(table)


def _play(
    benchmarks: Sequence[Any],
    choice: Choice,
    store: Store,
    folder: Path,
    html: Path | None,
    workers: int,
    as_json: bool,
) -> None:
    """Suite `paper`, with each problem's tables as soon as they are there."""
    from cps_agents.benchmark.report import document, tables
    from cps_agents.benchmark.suite import find_benchmark
    from cps_agents.report.report import PAPER

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


def _outcomes(benchmarks: Sequence[Any], choice: Choice, store: Store, workers: int) -> Iterator[Outcome]:
    from cps_agents.benchmark.suite import compile_kernels, run_benchmark

    compile_kernels(benchmarks, store, workers)
    for each in benchmarks:
        with Progress(each.problem, 1) as progress:
            yield run_benchmark(each, store, workers=workers, quick=choice.quick, report=progress.report)


def _write(outcomes: Sequence[Outcome], found: dict[str, Any], folder: Path) -> list[Path]:
    from cps_agents.benchmark.report import heat_maps, markdown, rows_as_csv

    files = [folder / f"benchmark.{suffix}" for suffix in ("json", "csv", "md")]
    write_json(files[0], found)
    write_text(files[1], rows_as_csv(outcomes))
    made = f"`{found['command']}`, {found['cpu']}, {found['cores']} cores, {found['wall_s']:.0f} s"
    write_text(files[2], "\n".join(["# Benchmark", "", made, "", *map(markdown, outcomes)]))
    for name, figure in (each for outcome in outcomes for each in heat_maps(outcome)):
        files.append(folder / f"{name}.png")
        write_figure(files[-1], figure)
    return files


def _show(outcome: Outcome) -> None:
    from cps_agents.benchmark.report import agreement, tables

    console = out()
    for table in tables(outcome):
        console.print(table)
    for note in filter(None, (*outcome.benchmark.notes, agreement(outcome))):
        console.print(note)


def _examine(
    blocks: Sequence[Block],
    store: Store,
    folder: Path,
    html: Path | None,
    workers: int,
    quick: bool,
    publish: bool,
    as_json: bool,
) -> None:
    """Suite `learned`, with each problem's tables as soon as they are there."""
    from cps_agents.results.document import document
    from cps_agents.results.examination import examine, together
    from cps_agents.results.publication import publish as put
    from cps_agents.results.publication import write
    from cps_agents.results.report import tables

    found, printed, console = [], list[Table](), out()
    for name in dict.fromkeys(block.problem for block in blocks):
        mine = [block for block in blocks if block.problem == name]
        with Progress(name, 1) as progress:
            found.append(examine(mine, store, workers=workers, quick=quick, report=progress.report))
        printed += (new := list(tables(document(mine, found[-1], describe(), quick))))
        for table in () if as_json else new:
            console.print(table)
    findings = together(found)
    result = document(blocks, findings, describe(), quick)
    files = [*write(result, folder), *(put(result, Path()) if publish else [])]
    files += [] if html is None else [_page(printed, LEARNED, html)]
    if as_json:
        print_json(result)
    conclude(files, findings.reused)


def _page(tables: Sequence[Table], about: tuple[str, str], folder: Path) -> Path:
    from cps_agents.report.report import Report, sheets_of_printed, write_report

    return write_report(Report(sheets=sheets_of_printed(tables), about_sheets=about), folder)
