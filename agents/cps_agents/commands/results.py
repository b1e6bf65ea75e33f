"""`cps-envs results`: the examination of the shipped policies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cps_agents.console import err, make_table, out, print_json

if TYPE_CHECKING:
    from cps_agents.results.block import Block
    from cps_agents.results.document import Document


def results(
    problem: Annotated[list[str] | None, typer.Option(help="Only this problem; may be repeated.")] = None,
    block: Annotated[list[str] | None, typer.Option(help="Only this block, see --list; may be repeated.")] = None,
    folder: Annotated[Path, typer.Option("--out", help="Where files go; finished work in cells/.")] = Path("results"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores if left out.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few episodes and short searches: a look, no result.")] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished work instead of going on from it.")] = False,
    publish: Annotated[
        bool, typer.Option("--publish", help="Renew docs/results.md, docs/results.json and the README's table here.")
    ] = False,
    show: Annotated[bool, typer.Option("--list", help="Print the blocks and stop.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
) -> None:
    """Examine the shipped policies: every target with baselines, bar and verdict.

    Each finished cell is kept at once: an interrupted run goes on where it stopped. Policies that are not shipped are
    listed as missing. --publish renews the blocks that were examined; with --block the others stay as they are.
    """
    from cps_agents.errors import CommandError
    from cps_agents.locking import alone_in
    from cps_agents.machine import available_cores
    from cps_agents.results.examination import find_blocks
    from cps_agents.results.publication import publish as put
    from cps_agents.results.terminal import tables
    from cps_envs import find_problem

    blocks = find_blocks([find_problem(name).name for name in problem or []], block or [])
    if show:
        _list(blocks)
        return
    if publish and quick:
        raise CommandError("--publish takes blocks at full length: leave out --quick")
    with alone_in(folder):
        found = _examine(blocks, folder, jobs or available_cores(), quick, fresh)
        files = [*_write(found, folder), *(put(found, Path()) if publish else [])]
    if as_json:
        print_json(found)
    else:
        console = out()
        for table in tables(found):
            console.print(table)
    if quick:
        err().print("--quick: few episodes and short searches; these are no results.")
    err().print(f"Written: {', '.join(map(str, files))}", soft_wrap=True)


def _examine(blocks: list[Block], folder: Path, jobs: int, quick: bool, fresh: bool) -> Document:
    from cps_agents.benchmark.store import Store
    from cps_agents.machine import describe
    from cps_agents.progress import Progress
    from cps_agents.results.document import document
    from cps_agents.results.examination import examine

    with Progress("examination", 1) as progress:

        def report(done: int, total: int, label: str) -> None:
            progress.total = total
            progress.update(done, label)

        store = Store(folder / "cells", fresh=fresh)
        findings = examine(blocks, store, workers=jobs, quick=quick, report=report)
    if findings.reused:
        err().print(f"{findings.reused} of {findings.jobs} cells were there already, --fresh computes them again.")
    return document(blocks, findings, describe(), quick)


def _write(found: Document, folder: Path) -> list[Path]:
    from cps_agents.files import write_json, write_text
    from cps_agents.results.markdown import readme_table, results_markdown

    files = [folder / "results.json", folder / "results.md", folder / "README-table.md"]
    write_json(files[0], found)
    write_text(files[1], results_markdown(found))
    write_text(files[2], readme_table(found) + "\n")
    return files


def _list(blocks: list[Block]) -> None:
    from cps_agents.results.examination import missing_of

    rows = []
    for each in blocks:
        missing = dict.fromkeys(name for names in missing_of(each).values() for name in names)
        rows.append((each.name, each.title, "\n".join(missing)))
    out().print(make_table("Blocks", ("name", "title", "missing policies"), rows, left=3))
