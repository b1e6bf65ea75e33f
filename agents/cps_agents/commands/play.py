"""`cps-envs play`: episodes between two policies."""

from __future__ import annotations

from typing import Annotated

import typer

from cps_agents.commands.options import AsJson, Changes
from cps_agents.console import assignments

POLICY = "A name from `cps-envs list`, name?option=value, or with --trust module:attribute; the preset's if left out."
RENDER = "human (a window), or FILE.mp4, FILE.gif (a film), FILE.png, FILE.svg (one picture)."


def play(
    problem: Annotated[str, typer.Argument(help="The problem, such as disbanding, or with --trust module:attribute.")],
    attacker: Annotated[str | None, typer.Option(help=POLICY)] = None,
    defender: Annotated[str | None, typer.Option(help=POLICY)] = None,
    preset: Annotated[str, typer.Option(help="The configuration to start from.")] = "paper",
    overrides: Changes = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the first episode; the others count up.")] = 0,
    episodes: Annotated[int, typer.Option(min=1, help="How many, played as one batch.")] = 1,
    render: Annotated[str | None, typer.Option(help=RENDER)] = None,
    fps: Annotated[float, typer.Option(help="Frames per second of a film.")] = 10.0,
    speed: Annotated[
        float | None,
        typer.Option(help="Game seconds per second of film; 10 if left out, and faster where a GIF would get long."),
    ] = None,
    at: Annotated[float | None, typer.Option(help="Game second of a picture; the end if left out.")] = None,
    as_json: AsJson = False,
) -> None:
    """Play episodes of one attacker against one defender: print their metrics, or film them."""
    from cps_agents.arena.meeting import Meeting
    from cps_agents.episodes import show_meeting
    from cps_agents.film import Film
    from cps_baselines.arena import Venue
    from cps_envs import find_problem

    found, values = find_problem(problem), assignments(overrides or [])
    found.config(preset, values)  # which refuses unknown ones
    usual = found.opponents[preset]
    pair = (attacker or usual["attacker"], defender or usual["defender"])
    film = Film(render, fps, speed, at) if render is not None else None
    show_meeting(Meeting(Venue(problem, preset, values), *pair, episodes, seed), film, as_json)
