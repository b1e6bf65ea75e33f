"""`cps-envs benchmark`: every analytic attacker against every defender, beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.console import err, out, print_json

if TYPE_CHECKING:
    from cps_agents.benchmark.runner import Outcome

Names = list[str] | None


def benchmark(
    folder: Annotated[Path, typer.Option("--out", help="Where files go; finished work in cells/.")] = Path("results"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores if left out.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few episodes and a short search: a look, no result.")] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished work instead of going on from it.")] = False,
    problem: Annotated[Names, typer.Option(help="Only this problem; may be repeated.")] = None,
    setting: Annotated[Names, typer.Option(help="Only this setting; may be repeated.")] = None,
    attacker: Annotated[Names, typer.Option(help="Only this attacker; may be repeated.")] = None,
    defender: Annotated[Names, typer.Option(help="Only this defender; may be repeated.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
) -> None:
    """Play every analytic attacker against every defender of every problem.

    Each finished cell is kept at once: an interrupted run goes on where it stopped. Cells are computed again when the
    code, a version or the configuration has changed.
    """
    import time

    from cps_agents.benchmark.report import document
    from cps_agents.benchmark.runner import find_benchmarks, select
    from cps_agents.locking import alone_in
    from cps_agents.machine import available_cores, describe
    from cps_envs import find_problem

    names = [find_problem(name).name for name in problem or []]
    wanted = {"setting": setting or [], "attacker": attacker or [], "defender": defender or []}
    chosen = [select(found, wanted, quick) for found in find_benchmarks(names)]
    started = time.monotonic()
    with alone_in(folder):
        outcomes = _play(chosen, folder, jobs or available_cores(), quick, fresh)
        wall_s = time.monotonic() - started
        found = document(outcomes, describe(), wall_s)
        files = _write(outcomes, found, folder)
    if as_json:
        print_json(found)
    else:
        _show(outcomes)
    if quick:
        err().print("--quick: few episodes and a short search; these are no results.")
    reused = sum(outcome.reused for outcome in outcomes)
    again = f"; {reused} cells were there already, --fresh computes them again" if reused else ""
    err().print(f"{wall_s:.0f} s{again}. Written: {', '.join(map(str, files))}", soft_wrap=True)


def _play(chosen: Sequence[Any], folder: Path, jobs: int, quick: bool, fresh: bool) -> list[Outcome]:
    from cps_agents.benchmark.runner import run_benchmark
    from cps_agents.benchmark.store import Store
    from cps_agents.progress import Progress

    store = Store(folder / "cells", fresh=fresh)
    outcomes = []
    for benchmark in chosen:
        with Progress(benchmark.problem, 1) as progress:

            def report(done: int, total: int, label: str, progress: Progress = progress) -> None:
                progress.total = total
                progress.update(done, label)

            outcomes.append(run_benchmark(benchmark, store, workers=jobs, quick=quick, report=report))
    return outcomes


def _write(outcomes: Sequence[Outcome], found: dict[str, Any], folder: Path) -> list[Path]:
    from cps_agents.benchmark.heatmap import draw_heat_maps
    from cps_agents.benchmark.report import markdown, rows_as_csv
    from cps_agents.files import write_json, write_text

    files = [folder / f"benchmark.{suffix}" for suffix in ("json", "csv", "md")]
    write_json(files[0], found)
    write_text(files[1], rows_as_csv(outcomes))
    made = f"`{found['command']}`, {found['cpu']}, {found['cores']} cores, {found['wall_s']:.0f} s"
    write_text(files[2], "\n".join(["# Benchmark", "", made, "", *map(markdown, outcomes)]))
    return [*files, *(path for outcome in outcomes for path in draw_heat_maps(outcome, folder))]


def _show(outcomes: Sequence[Outcome]) -> None:
    from cps_agents.benchmark.report import agreement, tables

    console = out()
    for outcome in outcomes:
        for table in tables(outcome):
            console.print(table)
        for note in outcome.benchmark.notes:
            console.print(note)
        console.print(agreement(outcome))
