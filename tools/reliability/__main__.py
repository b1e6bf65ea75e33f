"""`python -m tools.reliability`: tries to break the package, and counts what came out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.console import note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import alone_in
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet
from cps_envs.core.errors import near
from tools.command import run
from tools.reliability.chunk import PARTS, ROOT, Part, find_part
from tools.reliability.document import PROGRAM, document
from tools.reliability.document import publish as put
from tools.reliability.store import CHANGED, UNKNOWN, Store
from tools.reliability.suite import Findings, run_parts

BROKEN = 1
NAMES = "fuzz, faults, load, determinism or bounds; all if left out."


def reliability(
    parts: Annotated[list[str] | None, typer.Argument(metavar="[PART]...", help=NAMES)] = None,
    rows: Annotated[list[str] | None, typer.Option("--row", help="Only this row of a part; may be repeated.")] = None,
    minutes: Annotated[float, typer.Option(min=0.0, help="Time for what is not done yet; 0 only reports.")] = 10.0,
    folder: Annotated[Path, typer.Option("--out", help="Where finished work is kept.")] = Path("results/reliability"),
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished work instead of going on from it.")] = False,
    publish: Annotated[bool, typer.Option("--publish", help="Write docs/reliability.* when all is done.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
) -> None:
    """Try to break the package: hostile inputs, killed commands, long runs.

    Each finished piece is kept at once; the same command goes on from there. At
    another commit all of them are done again: a page is of one. The exit code is 1
    if anything happened that must not happen, if a piece could not be done, or if the
    page has to wait for more of them. It needs the repository, not only the package.
    """
    if publish and (parts or rows):
        raise CommandError("--publish writes the whole page: leave out the parts and --row")
    chosen = _only(rows or [], [find_part(name) for name in _names(parts or [])])
    total = sum(len(part.chunks()) for part in chosen)
    with alone_in(folder), Progress("reliability", total) as progress:

        def report(done: int, total: int, note: str) -> None:
            progress.total = total
            progress.update(done, note)

        store = Store(folder, fresh=fresh)
        if publish and (store.commit == UNKNOWN or store.commit.endswith(CHANGED)):
            raise CommandError("--publish names the commit that everything ran with: commit all changes first")
        found = run_parts(chosen, store, minutes, report, jobs=jobs)
    written = document(found, store.commit)
    if as_json:
        print_json(written)
    else:
        for each in found:
            console = out()
            console.print(_table(each))
            for line in each.examples:
                console.print(line, soft_wrap=True, markup=False)
    left = total - sum(len(each.results) for each in found)
    if publish and not left:
        note(f"Written: {', '.join(map(str, put(written, Path())))}")
    elif publish:
        note(f"No page yet: {left} of {total} pieces are left at commit {store.commit}. The same command goes on.")
    failed = [why for each in found for why in each.failed]
    for why in failed:
        note(why)
    violations = [f"{each.part.name}: {each.violations}" for each in found if each.violations]
    if violations:
        note(f"These have to be zero: {'; '.join(violations)}")
    if violations or failed or (publish and left):
        raise typer.Exit(BROKEN)


def _only(rows: Sequence[str], parts: Sequence[Part]) -> list[Part]:
    """The parts with some of their rows, all if none is named."""
    if not rows:
        return list(parts)
    known = {chunk.row for part in parts for chunk in part.chunks()}
    for row in rows:
        if row not in known:
            raise CommandError(f"--row {row!r}: there is no such row. {near(row, known)}")
    chosen = [(part, [chunk for chunk in part.chunks() if chunk.row in rows]) for part in parts]
    return [replace(part, chunks=partial(list, chunks)) for part, chunks in chosen if chunks]


def _names(chosen: Sequence[str]) -> list[str]:
    for name in chosen:
        if name not in PARTS:
            raise CommandError(f"there is no part {name!r}. {near(name, PARTS)}")
    if not (ROOT / "tests").is_dir():
        raise CommandError("the tests are not here: run this command in a checkout of the repository")
    return list(chosen) or list(PARTS)


def _table(found: Findings) -> Any:
    columns = found.part.columns
    rows = [(name, *(f"{row.get(key, 0):,.0f}" for key in columns)) for name, row in found.rows.items()]
    title = f"{found.part.title}: {len(found.results)} of {found.chunks} pieces"
    return Sheet(title, ("", *columns.values()), [*rows, _sums(found)] if len(rows) > 1 else rows)


def _sums(found: Findings) -> tuple[str, ...]:
    return ("in all", *(f"{count:,.0f}" for count in found.totals.values()))


if __name__ == "__main__":
    run(reliability, PROGRAM)
