"""`python -m tools.challenge.entries`: an entry for each shipped policy that has none; `make verify` plays them."""

from __future__ import annotations

from typing import Annotated

import typer

from cps_agents.console import note
from cps_agents.files import write_json
from cps_agents.scoring import board
from cps_agents.scoring.tracks import find_track, tracks
from tools.command import run


def entries(
    track: Annotated[list[str] | None, typer.Argument(help="Tracks such as rogue-attack; default: all eight.")] = None,
) -> None:
    """Write `entry.json` for each policy of a track's role that this package ships and that is no entry."""
    for found in map(find_track, track or tracks()):
        for policy in board.missing(found):
            path = board.FOLDER / found.name / policy.replace(":", "-").lower() / "entry.json"
            path.parent.mkdir(parents=True)
            write_json(path, {"policy": policy})
            note(f"Written: {path}")


if __name__ == "__main__":
    run(entries, "python -m tools.challenge.entries")
