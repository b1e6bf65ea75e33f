"""`cps-envs reproduce`: what the dissertation prints, computed by our code and put beside it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import typer

from cps_agents.commands.options import Html
from cps_agents.commands.reproduce.everything import everything
from cps_agents.commands.reproduce.showing import AsJson, Folder, Jobs, Sheets, show
from cps_agents.reproduction.commands import COMMANDS, Command, Option

app = typer.Typer(no_args_is_help=True)


@app.callback()
def reproduce() -> None:
    """Compute the tables, figures and claims of a chapter and put them beside what the paper prints."""


def command_of(command: Command) -> Callable[..., None]:
    """The function behind the command of a chapter, with its options as parameters."""

    def run(*, quick: bool, recheck: bool = False, **others: Any) -> None:
        chapter, shared = command.load(), {name: others.pop(name) for name in SHARED}
        named = [*(others.pop(command.part_option, None) or []), *(flag for flag in command.flags if others.pop(flag))]
        parts = chapter.chosen(named, quick=quick, recheck=recheck, option=f"--{command.part_option}")
        chapter.evidence(quick=quick, **others)  # wrong options are told before anything else
        compute = partial(chapter.reproduce, parts, quick=quick, recheck=recheck, **others)
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
    "plot": (None, Folder),
    "sheets": (None, Sheets),
    "html": (None, Html),
    "as_json": (False, AsJson),
}
KEYWORD = inspect.Parameter.KEYWORD_ONLY
for each in COMMANDS:
    app.command(each.name)(command_of(each))
app.command("all")(everything)
