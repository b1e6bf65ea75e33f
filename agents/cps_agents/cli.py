"""The command `cps-envs`. Modules of commands import nothing heavy; what a command needs it imports when it runs."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from cps_agents.commands.bench import bench
from cps_agents.commands.benchmark import benchmark
from cps_agents.commands.best_response import best_response
from cps_agents.commands.coverage import coverage
from cps_agents.commands.dataset import dataset
from cps_agents.commands.double_oracle import double_oracle
from cps_agents.commands.evaluate import evaluate
from cps_agents.commands.league import league
from cps_agents.commands.learnability import learnability
from cps_agents.commands.oracle import oracle
from cps_agents.commands.play import drive_robots, list_everything, play
from cps_agents.commands.reliability import reliability
from cps_agents.commands.report import report
from cps_agents.commands.reproduce import app as reproduce
from cps_agents.commands.score import app as score
from cps_agents.commands.searches import calibrate_mtd2, search_feedback, search_string, search_switching
from cps_agents.commands.self_play import self_play
from cps_agents.commands.string_stability import string_stability
from cps_agents.commands.train import train, tune
from cps_agents.commands.warm import warm
from cps_agents.commands.zoo import app as zoo
from cps_agents.console import err
from cps_agents.errors import explain
from cps_baselines.interruption import ending, exit_code

WRONG_INPUT = 2
GOING_ON = ("oracle", "double-oracle", "remake")  # from their files, beside the commands that have --resume or --fresh


class Commands(TyperGroup):
    """Turns errors that the user can put right into one message and exit code 2, and signals into a sentence.

    Ctrl-C gives exit code 130, SIGTERM 143.
    """

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            with ending():
                return super().invoke(ctx)
        except KeyboardInterrupt as error:
            err().print(f"Interrupted. {self._advice(ctx)}".strip(), soft_wrap=True)
            raise typer.Exit(exit_code(error)) from None
        except Exception as error:
            message = None if ctx.find_root().params.get("debug") or _is_control_flow(error) else explain(error)
            if message is None:
                raise
            err().print(f"[bold red]Error:[/] {_escaped(message)}", soft_wrap=True)
            raise typer.Exit(WRONG_INPUT) from error

    def _advice(self, ctx: Any) -> str:
        """How to go on with the command that was interrupted; empty where there is nothing to go on from."""
        name = ctx.invoked_subcommand
        command = self.get_command(ctx, name) if name else None
        options = {parameter.name for parameter in command.params} if command is not None else set()
        if "resume" in options:
            return "Finished work is kept: the same command with --resume continues."
        return "Finished work is kept: the same command continues." if "fresh" in options or name in GOING_ON else ""


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
    context_settings={"help_option_names": ["-h", "--help"]},
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
        "search-feedback": search_feedback,
        "search-string": search_string,
        "search-switching": search_switching,
    },
    "Judge": {
        "score": score,
        "evaluate": evaluate,
        "benchmark": benchmark,
        "league": league,
        "report": report,
        "coverage": coverage,
    },
    "Paper": {
        "reproduce": reproduce,
        "string-stability": string_stability,
        "oracle": oracle,
        "double-oracle": double_oracle,
        "calibrate-mtd2": calibrate_mtd2,
    },
    "Tools": {"warm": warm, "bench": bench, "reliability": reliability},
}


def _flowing(command: Callable[..., Any] | None) -> str:
    """A command's docstring with one line for each paragraph, so that the terminal's width breaks it."""
    return "\n\n".join(" ".join(part.split()) for part in (inspect.getdoc(command) or "").split("\n\n"))


for panel, commands in PANELS.items():
    for name, command in commands.items():
        if isinstance(command, typer.Typer):
            for part in command.registered_commands:
                part.help = _flowing(part.callback)
            app.add_typer(command, name=name, cls=command.info.cls or Commands, rich_help_panel=panel)
        else:
            app.command(name, help=_flowing(command), rich_help_panel=panel)(command)


def main() -> None:
    """Run the command line."""
    app(prog_name="cps-envs")
