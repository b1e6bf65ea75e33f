"""The command `cps-envs`. A command's module is imported when it runs: the list of commands loads none of them."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from cps_agents.console import err, note
from cps_agents.errors import explain
from cps_agents.interruption import ending, exit_code
from cps_agents.part import Unfinished

WRONG_INPUT = 2
TRUST = "--trust"
HELP = {"help_option_names": ["-h", "--help"]}


@dataclass(frozen=True)
class CommandEntry:
    """A command before its module is loaded."""

    place: str  # module:function, or module:app for a group of commands
    summary: str  # the first sentence of its help
    panel: str


def _panel(name: str, commands: Mapping[str, tuple[str, str]]) -> dict[str, CommandEntry]:
    return {command: CommandEntry(place, summary, name) for command, (place, summary) in commands.items()}


OURS = "cps_agents.commands"
COMMANDS: dict[str, CommandEntry] = {  # in the order of the help
    **_panel(
        "Play",
        {
            "list": (f"{OURS}.list:show", "Show the problems and their policies."),
            "play": (
                f"{OURS}.play:play",
                "Play one attacker against one defender: print the metrics, or film the episode.",
            ),
        },
    ),
    **_panel(
        "Learn",
        {
            "train": (f"{OURS}.train:train", "Train a policy by its recipe, one run for each seed."),
            "best-response": (
                f"{OURS}.best_response:best_response",
                "Find a best response to a fixed opponent: at least how far can it be exploited?",
            ),
            "self-play": (
                f"{OURS}.self_play:self_play",
                "Let both roles learn best responses in rounds, each against the equilibrium of all policies so far.",
            ),
            "zoo": (f"{OURS}.zoo:app", "Look up trained policies, shipped and your own, or add one."),
            "dataset": (
                f"{OURS}.dataset:dataset",
                "Record episodes of two policies as a dataset for offline learning.",
            ),
        },
    ),
    **_panel(
        "Judge",
        {
            "evaluate": (f"{OURS}.evaluate:evaluate", "Evaluate policies on seeds that training never used."),
            "score": (f"{OURS}.score:app", "Score a policy in a track: `cps-envs score rogue-attack POLICY`."),
            "league": (
                f"{OURS}.league:league",
                "Let every attacker play every defender, and solve the zero-sum game between them.",
            ),
            "report": (
                f"{OURS}.report:report",
                "Write a page to open in a browser: who beats whom, and episodes to watch.",
            ),
        },
    ),
    **_panel(
        "Paper",
        {
            "reproduce": (
                "cps_paper.commands.reproduce:app",
                "Compute the tables, figures and claims of a chapter and put them beside what the paper prints.",
            ),
            "certify": (
                f"{OURS}.certify:certify",
                "Find the highest impact speed that false data injection can reach, with a bound that proves it.",
            ),
        },
    ),
    **_panel(
        "Tools",
        {
            "warm": (f"{OURS}.warm:warm", "Compile all physics now, so that no later command has to wait for it."),
        },
    ),
}


class Deferred(TyperCommand):
    """A command whose module is not loaded yet."""

    def __init__(self, name: str, entry: CommandEntry) -> None:
        super().__init__(name, help=entry.summary, rich_help_panel=entry.panel)
        self.entry = entry

    def load(self) -> Any:
        """The command itself.

        Raises:
            MissingExtraError: a package that it needs is not installed.
        """
        module, _, attribute = self.entry.place.partition(":")
        try:
            found = getattr(import_module(module), attribute)
        except ModuleNotFoundError as error:
            from cps_envs.core.errors import EXTRAS, MissingExtraError

            package = (error.name or "").partition(".")[0]
            if package not in EXTRAS:
                raise
            raise MissingExtraError(
                f"`cps-envs {self.name}` needs the package {package!r}. Install it with: "
                f'pip install "cps-envs[{EXTRAS[package]}]"'
            ) from error
        return command_of(found, self.name or "")


def command_of(found: Callable[..., None] | typer.Typer, name: str) -> Any:
    """A function or a group as a command of this name."""
    if isinstance(found, typer.Typer):
        for part in found.registered_commands:
            part.help = flowing(part.callback)
        root = typer.Typer(add_completion=False)
        root.add_typer(found, name=name, cls=found.info.cls or Commands)
        whole_root: Any = get_command(root)
        return whole_root.commands[name]
    app = typer.Typer(add_completion=False)
    app.command(name, help=flowing(found))(found)
    return get_command(app)


def flowing(command: Callable[..., Any] | None) -> str:
    """A command's docstring with one line for each paragraph, so that the terminal's width breaks it."""
    return "\n\n".join(" ".join(part.split()) for part in (inspect.getdoc(command) or "").split("\n\n"))


@contextmanager
def told(ctx: Any, advice: Callable[[], str]) -> Iterator[None]:
    """Turn errors that the user can put right into one message and exit code 2, and signals into a sentence.

    Ctrl-C gives exit code 130, SIGTERM 143.
    """
    try:
        with ending():
            yield
    except KeyboardInterrupt as error:
        _say(f"Interrupted. {advice()}".strip())
        raise typer.Exit(exit_code(error)) from None
    except Unfinished as others:
        _say(_escaped(str(others)))
        raise typer.Exit from None
    except Exception as error:
        _name_choices(error)
        message = None if ctx.find_root().params.get("debug") or _is_control_flow(error) else explain(error)
        if message is None:
            raise
        _say(f"[bold red]Error:[/] {_escaped(message)}")
        raise typer.Exit(WRONG_INPUT) from error


def _name_choices(error: Exception) -> None:
    """Let the command-line library's error about a missing argument say what may be written there."""
    missing = getattr(getattr(error, "param", None), "name", None)
    if missing == "problem":
        from cps_envs import PROBLEMS

        error.message = f"Problems: {', '.join(PROBLEMS)}."  # type: ignore[attr-defined]
    elif missing == "role":
        error.message = "Roles: attacker, defender."  # type: ignore[attr-defined]


def _say(line: str) -> None:
    with suppress(OSError):  # of a full disk behind stderr: the exit code is told all the same
        err().print(line, soft_wrap=True)


def advice(command: Any) -> str:
    """How to go on with a command that was interrupted; empty where there is nothing to go on from."""
    options = {parameter.name for parameter in command.params} if command is not None else set()
    if "resume" in options:
        return "Finished work is kept: the same command with --resume continues."
    goes_on = "fresh" in options or (command is not None and command.name == "certify")
    return "Finished work is kept: the same command continues." if goes_on else ""


class Commands(TyperGroup):
    """A group of commands whose errors are told in a sentence, see `told`."""

    chosen: Any = None  # the one that runs

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that is asked for, its module loaded."""
        name, command, left = super().resolve_command(ctx, args)
        self.chosen = command.load() if isinstance(command, Deferred) else command
        return name, self.chosen, left

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        with told(ctx, lambda: advice(self.chosen)):
            return super().invoke(ctx)


class Everything(Commands):
    """All commands, in the order of the panels."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = {name: Deferred(name, entry) for name, entry in COMMANDS.items()}

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The arguments; --trust may also stand behind the command."""
        trusting = TRUST in args[: args.index("--")] if "--" in args else TRUST in args
        found: list[str] = super().parse_args(
            ctx, [TRUST, *(each for each in args if each != TRUST)] if trusting else args
        )
        return found

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of all commands."""
        return list(self.commands)


class Single(TyperCommand):
    """A program of one command whose errors are told in a sentence, see `told`."""

    def invoke(self, ctx: Any) -> Any:
        """Run it."""
        with told(ctx, lambda: advice(self)):
            return super().invoke(ctx)


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
        from cps_envs.core.policies.trust import trust

        trust()


app = typer.Typer(cls=Everything, no_args_is_help=True, pretty_exceptions_show_locals=False, context_settings=HELP)


@app.callback()
def options(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of every error.")] = False,
    trusting: Annotated[
        bool, typer.Option(TRUST, callback=_agree, help="Allow module:attribute and sb3:FILE, which run code.")
    ] = False,
    show_version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Play, train and judge attackers and defenders of cyber-physical systems."""


def whole() -> Any:
    """The command line with the modules of all commands loaded, as those need it who read its options."""
    group: Any = get_command(app)
    group.commands = {name: command.load() for name, command in group.commands.items()}
    return group


def main() -> None:
    """Run the command line."""
    warnings.showwarning = show_warning
    app(prog_name="cps-envs")


def show_warning(message: Warning | str, category: type[Warning], *place: Any, **_: Any) -> None:
    """A warning on stderr; one of ours as a note, without the place in the code that gave it."""
    from cps_envs.core.declare.foreign import ForeignSettingWarning

    ours = issubclass(category, ForeignSettingWarning)
    note(f"Note: {message}." if ours else warnings.formatwarning(message, category, *place[:2]).rstrip())
