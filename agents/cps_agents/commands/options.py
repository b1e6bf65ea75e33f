"""Options that commands share, and what they say at their end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.console import err, print_json

MEETINGS = Path("results/meetings")
KEPT = "Where finished meetings are kept; all commands share it."
FRESH = "Play again what was played before."
Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores if left out.")]
Fresh = Annotated[bool, typer.Option("--fresh", help=FRESH)]
AsJson = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
Html = Annotated[Path | None, typer.Option(metavar="DIR", help="Write a page for the browser there, too.")]
Changes = Annotated[
    list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated.")
]
OfEnvironment = Annotated[
    list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Of the environment; may be repeated.")
]
Knobs = Annotated[
    list[str] | None, typer.Option("--knob", metavar="NAME=VALUE", help="Of the recipe; may be repeated.")
]
ORACLE = (
    "Who responds: search, cma-es, plans, ppo, recurrent, or a recipe's name; may be repeated. If left out, all of "
    "these that the role has, but for recurrent."
)
STEPS = "Decisions of each oracle and training seed, searches included."
BUDGET = "CPU time of each oracle and training seed."
Oracles = Annotated[list[str] | None, typer.Option("--oracle", metavar="NAME", help=ORACLE)]
Steps = Annotated[int | None, typer.Option(min=1, help=STEPS)]
BudgetS = Annotated[float | None, typer.Option("--budget", metavar="SECONDS", min=0.1, help=BUDGET)]
Meetings = Annotated[Path, typer.Option("--meetings", metavar="DIR", envvar="CPS_ENVS_MEETINGS", help=KEPT)]


def deliver(result: Any, to: Path | None, said: str) -> None:
    """Write a result as JSON and say so, or print it where no file is named."""
    from cps_agents.files import write_json

    if to is None:
        print_json(result)
        return
    write_json(to, result)
    err().print(f"{said}: {to}", soft_wrap=True)


def conclude(files: Sequence[Path], reused: int = 0, *notes: str) -> None:
    """Say what was found finished and what was written."""
    again = f"Played before: {reused} meeting{'s' * (reused > 1)}; --fresh plays again." if reused else ""
    written = f"Written: {', '.join(map(str, files))}." if files else ""
    if said := " ".join(filter(None, (*notes, again, written))):
        err().print(said, soft_wrap=True)
