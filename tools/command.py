"""Tools as programs of one command, which say what is wrong as `cps-envs` does."""

from __future__ import annotations

from collections.abc import Callable

import typer

from cps_agents.cli import HELP, Single, flowing


def program(command: Callable[..., None]) -> typer.Typer:
    """A function as a program, with its parameters as arguments and options."""
    app = typer.Typer(add_completion=False, pretty_exceptions_show_locals=False, context_settings=HELP)
    app.command(cls=Single, help=flowing(command))(command)
    return app


def run(command: Callable[..., None], name: str) -> None:
    """Run a function as the program of this name."""
    program(command)(prog_name=name)
