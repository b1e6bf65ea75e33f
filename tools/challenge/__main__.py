"""`python -m tools.challenge`: freeze the tracks of the challenge, which makes every score before it another one."""

from __future__ import annotations

from typing import Annotated

import typer

from cps_agents.console import note, out
from cps_agents.errors import CommandError
from cps_agents.scoring.tracks import find_track, tracks
from tools.challenge.freezing import freeze
from tools.command import run


def challenge(
    track: Annotated[list[str] | None, typer.Argument(help="Tracks such as rogue-attack; default: all eight.")] = None,
    episodes: Annotated[int, typer.Option(min=16, help="Against each opponent, for the scores 0 and 100.")] = 4096,
    constant: Annotated[
        list[str] | None, typer.Option(metavar="POLICY", help="Try only this for score 0; may be repeated.")
    ] = None,
) -> None:
    """Find what the scores 0 and 100 are paid, and write the files that `cps-envs score` compares with."""
    for found in map(find_track, track or tracks()):
        if episodes * 8 < found.episodes:
            raise CommandError(f"--episodes {episodes} is less than an eighth of the {found.episodes} of {found.name}")
        path = freeze(found, episodes, constant or (), lambda line: out().print(line, soft_wrap=True, markup=False))
        note(f"Written: {path}")


if __name__ == "__main__":
    run(challenge, "python -m tools.challenge")
