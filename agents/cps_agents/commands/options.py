"""Options that commands share, and what they say at their end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.console import err, print_json
from cps_agents.files import write_json

MEETINGS = Path("results/meetings")
KEPT = "Keep finished games in this folder, which all commands share."
FRESH = "Play everything again, also what is kept."
Jobs = Annotated[int | None, typer.Option(min=1, help="Use so many processes; default: all cores.")]
Fresh = Annotated[bool, typer.Option("--fresh", help=FRESH)]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Html = Annotated[Path | None, typer.Option(metavar="DIR", help="Also write a page for the browser to this folder.")]
Changes = Annotated[
    list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated.")
]
Knobs = Annotated[
    list[str] | None, typer.Option("--knob", metavar="NAME=VALUE", help="Change a knob; may be repeated.")
]
ORACLE = "By shared-ppo (our own PPO), search (numbers of hand-made policies), or a recipe; may be repeated."
STEPS = "Decisions for each method and training seed, searches included."
BUDGET = "CPU time for each method and training seed; default: 60."
Oracles = Annotated[list[str] | None, typer.Option("--oracle", metavar="NAME", help=ORACLE)]
Steps = Annotated[int | None, typer.Option(min=1, help=STEPS)]
BudgetS = Annotated[float | None, typer.Option("--budget", metavar="SECONDS", min=0.1, help=BUDGET)]
Meetings = Annotated[Path, typer.Option("--meetings", metavar="DIR", envvar="CPS_ENVS_MEETINGS", help=KEPT)]


def deliver(result: Any, to: Path | None, said: str) -> None:
    """Write a result as JSON and say so, or print it where no file is named."""
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
