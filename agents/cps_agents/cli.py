"""The command `cps-envs`. Modules of commands import nothing heavy; what a command needs it imports when it runs."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from importlib.util import find_spec
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from cps_agents.commands.bench import bench
from cps_agents.commands.best_response import best_response
from cps_agents.commands.dataset import dataset
from cps_agents.commands.evaluate import evaluate
from cps_agents.commands.league import league
from cps_agents.commands.learnability import learnability
from cps_agents.commands.oracle import oracle
from cps_agents.commands.play import drive_robots, list_everything, play
from cps_agents.commands.report import report
from cps_agents.commands.score import app as score
from cps_agents.commands.self_play import self_play
from cps_agents.commands.train import train, tune
from cps_agents.commands.warm import warm
from cps_agents.commands.zoo import app as zoo
from cps_agents.console import err
from cps_agents.errors import explain
from cps_baselines.interruption import ending, exit_code

WRONG_INPUT = 2
HELP = {"help_option_names": ["-h", "--help"]}
GOING_ON = ("oracle", "double-oracle", "remake")  # from their files, beside the commands that have --resume or --fresh


@contextmanager
def told(ctx: Any, advice: Callable[[], str]) -> Iterator[None]:
    """Turn errors that the user can put right into one message and exit code 2, and signals into a sentence.

    Ctrl-C gives exit code 130, SIGTERM 143.
    """
    try:
        with ending():
            yield
    except KeyboardInterrupt as error:
        err().print(f"Interrupted. {advice()}".strip(), soft_wrap=True)
        raise typer.Exit(exit_code(error)) from None
    except Exception as error:
        message = None if ctx.find_root().params.get("debug") or _is_control_flow(error) else explain(error)
        if message is None:
            raise
        err().print(f"[bold red]Error:[/] {_escaped(message)}", soft_wrap=True)
        raise typer.Exit(WRONG_INPUT) from error


def advice(command: Any) -> str:
    """How to go on with a command that was interrupted; empty where there is nothing to go on from."""
    options = {parameter.name for parameter in command.params} if command is not None else set()
    if "resume" in options:
        return "Finished work is kept: the same command with --resume continues."
    goes_on = "fresh" in options or (command is not None and command.name in GOING_ON)
    return "Finished work is kept: the same command continues." if goes_on else ""


class Commands(TyperGroup):
    """A group of commands whose errors are told in a sentence, see `told`."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""

        def going_on() -> str:
            name = ctx.invoked_subcommand
            return advice(self.get_command(ctx, name) if name else None)

        with told(ctx, going_on):
            return super().invoke(ctx)


class Single(TyperCommand):
    """A program of one command whose errors are told in a sentence, see `told`."""

    def invoke(self, ctx: Any) -> Any:
        """Run it."""
        with told(ctx, lambda: advice(self)):
            return super().invoke(ctx)


class Panels(Commands):
    """The commands in the order of the panels."""

    def list_commands(self, ctx: Any) -> list[str]:
        """All names."""
        return [name for panel in PANELS.values() for name in panel]


def _is_control_flow(error: Exception) -> bool:
    """Whether the error is one of the command-line library's own, or a reader of our output that went away."""
    return isinstance(error, (typer.Exit, typer.Abort, BrokenPipeError)) or hasattr(error, "exit_code")


def _escaped(message: str) -> str:
    from rich.markup import escape

    return escape(message)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"cps-envs {version('cps-envs')}")
        raise typer.Exit


def _agree(wanted: bool) -> None:
    if wanted:
        from cps_envs.core.trust import trust

        trust()


app = typer.Typer(
    cls=Panels,
    no_args_is_help=True,
    pretty_exceptions_show_locals=False,
    context_settings=HELP,
)


@app.callback()
def options(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of every error.")] = False,
    trusting: Annotated[
        bool, typer.Option("--trust", callback=_agree, help="Allow module:attribute and sb3:FILE, which run code.")
    ] = False,
    show_version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Play, train and judge attackers and defenders of cyber-physical systems."""


PANELS: dict[str, dict[str, Callable[..., None] | typer.Typer]] = {  # in the order of the help
    "Play": {"list": list_everything, "play": play, "testbed": drive_robots},
    "Learn": {
        "train": train,
        "learnability": learnability,
        "zoo": zoo,
        "tune": tune,
        "best-response": best_response,
        "self-play": self_play,
        "dataset": dataset,
    },
    "Judge": {
        "score": score,
        "evaluate": evaluate,
        "league": league,
        "report": report,
    },
    "Paper": {
        "oracle": oracle,
    },
    "Tools": {"warm": warm, "bench": bench},
}


if find_spec("cps_paper") is None:

    def needs_paper(words: Annotated[list[str] | None, typer.Argument(hidden=True)] = None) -> None:
        """Say how to install the package of the dissertation."""
        from cps_envs.core.errors import require

        require("cps_paper", extra="paper", purpose="This command")

    unread = {"ignore_unknown_options": True, "allow_extra_args": True}
    for name in ("benchmark", "reproduce", "string-stability"):
        app.command(name, context_settings=unread, rich_help_panel="Paper")(needs_paper)
else:
    from cps_paper.commands.benchmark import benchmark
    from cps_paper.commands.reproduce import app as reproduce
    from cps_paper.commands.string_stability import string_stability

    PANELS["Judge"]["benchmark"] = benchmark
    PANELS["Paper"] |= {"reproduce": reproduce, "string-stability": string_stability}


def flowing(command: Callable[..., Any] | None) -> str:
    """A command's docstring with one line for each paragraph, so that the terminal's width breaks it."""
    return "\n\n".join(" ".join(part.split()) for part in (inspect.getdoc(command) or "").split("\n\n"))


for panel, commands in PANELS.items():
    for name, command in commands.items():
        if isinstance(command, typer.Typer):
            for part in command.registered_commands:
                part.help = flowing(part.callback)
            app.add_typer(command, name=name, cls=command.info.cls or Commands, rich_help_panel=panel)
        else:
            app.command(name, help=flowing(command), rich_help_panel=panel)(command)


def main() -> None:
    """Run the command line."""
    app(prog_name="cps-envs")
