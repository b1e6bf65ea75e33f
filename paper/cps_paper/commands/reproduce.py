"""`cps-envs reproduce`: what the dissertation prints, computed by our code and put beside it.

The commands of all chapters share computing with progress, then tables or JSON, figures, and an exit code.
`cps-envs reproduce all` computes every chapter under every reading of it that we offer.
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.arena.store import Store
from cps_agents.cli import Commands
from cps_agents.commands.options import AtCluster, Html, workers
from cps_agents.console import err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import alone_in, write_json, write_text
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.report.report import Report, write_report
from cps_agents.sheet import Sheet
from cps_agents.workers import Where
from cps_paper.chapter import Reproduction
from cps_paper.commands.benchmark import benchmark
from cps_paper.commands.chapters import COMMANDS, Command, Option
from cps_paper.commands.numbers import by_number
from cps_paper.commands.readings import ChapterReading, chosen, draw, readings, render, summarize, write_sheets
from cps_paper.commands.summary import COUNTED, DEPENDING, counted, depending, failed, refuse_older_rechecks
from cps_paper.commands.summary import publish as put
from cps_paper.evidence import Report as Told
from cps_paper.figures import require_matplotlib

Jobs = Annotated[int | None, typer.Option(min=1, help="Use so many processes; default: all cores.")]
Folder = Annotated[Path | None, typer.Option(metavar="DIR", help="Write the figures to this folder, as PNG files.")]
Sheets = Annotated[
    Path | None, typer.Option("--csv", metavar="DIR", help="Write the tables to this folder, as CSV files.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else on stdout.")]
Whole = Annotated[bool, typer.Option("--all", help="Print every table in full, also where no part is named.")]

REGRESSION = 1  # exit code
PERCENT = 100


def show(
    title: str,
    compute: Callable[[Where, Told], Reproduction[Any]],
    *,
    jobs: int | None,
    cluster: str | None,
    plot: Path | None,
    sheets: Path | None,
    html: Path | None,
    as_json: bool,
    whole: bool,
) -> None:
    """Compute by processes or on a cluster, reporting progress; print; write figures, tables and a page into folders.

    What is printed are all tables, or without `whole` how often each of them agrees with the paper.

    Raises:
        MissingExtraError: figures are wanted and matplotlib is not installed; nothing has been computed yet.
        typer.Exit: with REGRESSION, after all that, where our numbers have left the reference.
    """
    if plot is not None:
        require_matplotlib()
    where, started = workers(jobs, cluster), time.monotonic()
    with Progress(title, PERCENT) as progress:
        found = compute(where, lambda share, label: progress.update(int(PERCENT * share), label))
    wall_s = time.monotonic() - started
    files = [] if plot is None else draw(found, plot)
    undrawn = " No figure: the parts asked for have none." if plot is not None and not files else ""
    files += [] if sheets is None else write_sheets(found, sheets)
    if html is not None:
        files.append(write_report(Report(sheets=[table.sheet for table in found.tables()], title=title), html))
    if as_json:
        print_json({**found.document(), "files": list(map(str, files)), "wall_s": wall_s, **describe()})
    elif whole:
        render(out(), found)
    else:
        summarize(out(), found)
    written = f" Written: {', '.join(map(str, files))}" if files else ""
    err().print(f"{wall_s:.0f} s.{written}{undrawn}", soft_wrap=True)
    if not found.passed:
        raise typer.Exit(REGRESSION)


ONLY = "Compute only this reading, such as ch2-S0 or ch5; may be repeated."
QUICK = "Run every chapter with --quick: a tenth of the time, no result."
RECHECK = "Judge the claims of chapters 2, 4 and 5 again under other conditions."
PUBLISH = "Renew these readings in the tables of docs/reproduction.md here."


def everything(
    only: Annotated[list[str] | None, typer.Option("--reading", metavar="NAME", help=ONLY)] = None,
    quick: Annotated[bool, typer.Option("--quick", help=QUICK)] = False,
    recheck: Annotated[bool, typer.Option("--recheck", help=RECHECK)] = False,
    folder: Annotated[
        Path, typer.Option("--out", help="Write files to this folder; done/ keeps finished work.")
    ] = Path("reproduced"),
    jobs: Jobs = None,
    cluster: AtCluster = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished work and begin again.")] = False,
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
    if publish and quick:
        raise CommandError("nothing that was computed with --quick is published")
    every = readings(quick=quick, recheck=recheck)
    todo = chosen(every, only or [])
    if publish and not recheck:
        refuse_older_rechecks([each.name for each in todo], Path())
    machine, where = describe(), workers(jobs, cluster)
    summary = folder / "summary.json"
    with alone_in(folder):
        store = Store(folder / "done", fresh=fresh)
        found = [{**machine, **each} for each in _finish(todo, store, where, folder)]
        plain = [{name: value for name, value in each.items() if name != "text"} for each in found]
        write_json(summary, plain)
        files = [summary, *(put(found, Path(), [each.name for each in every]) if publish else [])]
    if as_json:
        print_json(plain)
    else:
        out().print(Sheet("Verdicts by reading of the text", COUNTED, counted(found), left=3))
        out().print(Sheet("Claims whose verdict depends on the reading", DEPENDING, depending(found), left=3))
    err().print(
        f"Written: {', '.join(map(str, files))}; tables and numbers of each reading in {folder}", soft_wrap=True
    )
    if left := failed(found):
        err().print(f"Our own numbers left their reference: {', '.join(left)}. The simulation has changed.")
        raise typer.Exit(REGRESSION)


def _finish(todo: Sequence[ChapterReading], store: Store, where: Where, folder: Path) -> Iterator[dict[str, Any]]:
    """Compute what is not there yet, one reading after the other, and write the files of each."""
    for place, reading in enumerate(todo, 1):
        result = store.get(reading)
        if result is None:
            with Progress(f"{reading.name}, {place} of {len(todo)}", 100) as progress:
                result = reading.run(where, lambda share, label: progress.update(int(100 * share), label))
            store.put(reading, result)
        else:
            err().print(f"{reading.name} was finished already; --fresh does it again.")
        write_text(folder / f"{reading.name}.txt", result["text"])
        write_json(folder / f"{reading.name}.json", result["document"])
        yield {"chapter": reading.chapter, "reading": reading.name, "recheck": reading.recheck, **result}


class Numbered(Commands):
    """The commands of the chapters, also found by the number of a table or figure."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that is asked for."""
        return super().resolve_command(ctx, by_number(args))


app = typer.Typer(cls=Numbered, no_args_is_help=True)


@app.callback()
def reproduce() -> None:
    """Compute the tables, figures and claims of a chapter and put them beside what the paper prints.

    A table or figure can be asked for by its number in the dissertation: `cps-envs reproduce 4.2`, `fig 5.6`.
    """


def command_of(command: Command) -> Callable[..., None]:
    """The function behind the command of a chapter, with its options as parameters."""

    def run(*, quick: bool, recheck: bool = False, **others: Any) -> None:
        chapter, shared = command.load(), {name: others.pop(name) for name in SHARED}
        named = [*(others.pop(command.part_option, None) or []), *(flag for flag in command.flags if others.pop(flag))]
        parts = chapter.chosen(named, quick=quick, recheck=recheck, option=f"--{command.part_option}")
        chapter.evidence(quick=quick, **others)  # wrong options are told before anything else
        compute = partial(chapter.reproduce, parts, quick=quick, recheck=recheck, **others)
        shared["whole"] = shared["whole"] or bool(named) or not command.parts
        show(chapter.title, lambda jobs, report: compute(jobs=jobs, report=report), **shared)

    parameters = _parameters(command)
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__doc__ = command.help
    return run


def _parameters(command: Command) -> list[inspect.Parameter]:
    flags = [
        Option("quick", bool, False, command.quick),
        *(Option(flag, bool, False, f"The same as --{command.part_option} {flag}.") for flag in command.flags),
        *([Option("recheck", bool, False, command.recheck)] if command.recheck else []),
    ]
    parts = Option(command.part_option, list[str] | None, None, command.parts, "PART")
    every = [*([parts] if command.parts else []), *command.options, *flags]
    return [
        *map(_parameter, every),
        *(
            inspect.Parameter(name, KEYWORD, default=default, annotation=kind)
            for name, (default, kind) in SHARED.items()
        ),
    ]


def _parameter(option: Option) -> inspect.Parameter:
    names = [f"--{option.name.replace('_', '-')}"] if option.kind is bool else []  # no --no-...
    shown = typer.Option(*names, help=option.help, metavar=option.metavar, min=option.least)
    return inspect.Parameter(option.name, KEYWORD, default=option.default, annotation=Annotated[option.kind, shown])


SHARED = {
    "jobs": (None, Jobs),
    "cluster": (None, AtCluster),
    "plot": (None, Folder),
    "sheets": (None, Sheets),
    "html": (None, Html),
    "as_json": (False, AsJson),
    "whole": (False, Whole),
}
KEYWORD = inspect.Parameter.KEYWORD_ONLY
for each in COMMANDS:
    app.command(each.name)(command_of(each))
app.command("all")(everything)
app.command("benchmark")(benchmark)
