"""The command line as tests use it."""

from __future__ import annotations

from typing import Any

import typer
import typer.rich_utils  # now: it takes the width of the terminal that is there when it is imported
from typer.testing import CliRunner

from cps_agents.cli import app


def invoke(*arguments: str, columns: int = 100, program: typer.Typer = app) -> Any:
    """The result of `cps-envs ARGUMENTS`, or of another program, on a terminal of so many columns."""
    return CliRunner().invoke(program, list(arguments), env={"COLUMNS": str(columns), "TERMINAL_WIDTH": str(columns)})


def succeeded(*arguments: str, columns: int = 100, program: typer.Typer = app) -> Any:
    """The result of `cps-envs ARGUMENTS`, which has to end without an error."""
    result = invoke(*arguments, columns=columns, program=program)
    assert result.exit_code == 0, result.output
    return result


def refusal(*arguments: str, program: typer.Typer = app) -> str:
    """The message of `cps-envs ARGUMENTS`, which has to be all that a wrong input leads to."""
    result = invoke(*arguments, program=program)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return " ".join(result.stderr.split())
