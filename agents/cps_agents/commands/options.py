"""Options that all commands of the arena share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

MEETINGS = Path("results/meetings")
KEPT = "Where finished meetings are kept; all commands share it."
FRESH = "Play again what was played before."
Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores if left out.")]
Fresh = Annotated[bool, typer.Option("--fresh", help=FRESH)]
AsJson = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
Meetings = Annotated[Path, typer.Option("--meetings", metavar="DIR", envvar="CPS_ENVS_MEETINGS", help=KEPT)]
Names = Annotated[list[str] | None, typer.Option()]
