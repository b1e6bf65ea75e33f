"""Options that all commands of the arena share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from cps_agents.console import err

MEETINGS = Path("results/meetings")
KEPT = "Keep finished games in this folder, which all commands share."
FRESH = "Play everything again, also what is kept."
Jobs = Annotated[int | None, typer.Option(min=1, help="Use so many processes; default: all cores.")]
Fresh = Annotated[bool, typer.Option("--fresh", help=FRESH)]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Meetings = Annotated[Path, typer.Option("--meetings", metavar="DIR", envvar="CPS_ENVS_MEETINGS", help=KEPT)]


def conclude(files: Sequence[Path], reused: int = 0, *notes: str) -> None:
    """Say what was found finished and what was written."""
    again = f"Played before: {reused} meeting{'s' * (reused > 1)}; --fresh plays again." if reused else ""
    written = f"Written: {', '.join(map(str, files))}." if files else ""
    if said := " ".join(filter(None, (*notes, again, written))):
        err().print(said, soft_wrap=True)
