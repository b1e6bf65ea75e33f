"""`cps-envs reproduce all`: every chapter under every reading of it that we offer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.commands.reproduce.showing import REGRESSION, AsJson, Jobs
from cps_agents.console import err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.locking import alone_in
from cps_agents.machine import available_cores, describe
from cps_agents.progress import Progress
from cps_agents.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cps_agents.arena.store import Store
    from cps_agents.reproduction.readings import Reading

ONLY = "Compute only this reading, such as ch2-S0 or ch5; may be repeated."
QUICK = "Run every chapter with --quick: a tenth of the time, no result."
RECHECK = "Judge the claims of chapters 2, 4 and 5 again under other conditions."
PUBLISH = "Renew the tables of docs/reproduction.md here."


def everything(
    only: Annotated[list[str] | None, typer.Option("--reading", metavar="NAME", help=ONLY)] = None,
    quick: Annotated[bool, typer.Option("--quick", help=QUICK)] = False,
    recheck: Annotated[bool, typer.Option("--recheck", help=RECHECK)] = False,
    folder: Annotated[
        Path, typer.Option("--out", help="Write files to this folder; done/ keeps finished work.")
    ] = Path("reproduced"),
    jobs: Jobs = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished work and begin anew.")] = False,
    publish: Annotated[bool, typer.Option("--publish", help=PUBLISH)] = False,
    as_json: AsJson = False,
) -> None:
    """Compute every chapter under every reading of the text, and one table of all verdicts.

    Each reading leaves a file with its tables (such as ch2-S0.txt) and one
    with its numbers (ch2-S0.json). A chapter's own command has more options,
    and figures.

    Press Ctrl-C at any time: finished readings are kept, and the same command
    continues. The exit code is 1 when our own numbers left their reference
    values: then a simulation has changed.
    """
    from cps_agents.arena.store import Store
    from cps_agents.reproduction.readings import chosen, readings
    from cps_agents.reproduction.summary import COUNTED, DEPENDING, counted, depending, failed
    from cps_agents.reproduction.summary import publish as put

    if publish and (quick or only):
        raise CommandError("only the whole, without --quick or --reading, is published")
    todo = chosen(readings(quick=quick, recheck=recheck), only or [])
    machine = describe()
    summary = folder / "summary.json"
    with alone_in(folder):
        store = Store(folder / "done", fresh=fresh)
        found = [{**machine, **each} for each in _finish(todo, store, jobs, folder)]
        plain = [{name: value for name, value in each.items() if name != "text"} for each in found]
        write_json(summary, plain)
        files = [summary, *(put(found, Path()) if publish else [])]
    if as_json:
        print_json(plain)
    else:
        out().print(Table("Verdicts by reading of the text", COUNTED, counted(found), left=3))
        out().print(Table("Claims whose verdict depends on the reading", DEPENDING, depending(found), left=3))
    err().print(
        f"Written: {', '.join(map(str, files))}; tables and numbers of each reading in {folder}", soft_wrap=True
    )
    if left := failed(found):
        err().print(f"Our own numbers left their reference: {', '.join(left)}. The simulation has changed.")
        raise typer.Exit(REGRESSION)


def _finish(todo: Sequence[Reading], store: Store, jobs: int | None, folder: Path) -> Iterator[dict[str, Any]]:
    """Compute what is not there yet, one reading after the other, and write the files of each."""
    for place, reading in enumerate(todo, 1):
        result = store.get(reading)
        if result is None:
            with Progress(f"{reading.name}, {place} of {len(todo)}", 100) as progress:
                result = reading.run(
                    jobs or available_cores(), lambda share, label: progress.update(int(100 * share), label)
                )
            store.put(reading, result)
        else:
            err().print(f"{reading.name} was finished already; --fresh does it again.")
        write_text(folder / f"{reading.name}.txt", result["text"])
        write_json(folder / f"{reading.name}.json", result["document"])
        yield {"chapter": reading.chapter, "reading": reading.name, "recheck": reading.recheck, **result}
