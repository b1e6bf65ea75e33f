"""`cps-envs play`: episodes between two policies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cps_agents.arena.meeting import Meeting
from cps_agents.arena.venue import Venue
from cps_agents.commands.options import AsJson, Attacker, Changes, Config, Defender, Preset, described
from cps_agents.film import Film, show_meeting
from cps_envs import find_problem

RECORD = "Write the first episode to a .csv, .csv.gz or .parquet; trace?file=FILE plays it."
RENDER = "Show a window (human), or write FILE.mp4, FILE.gif, FILE.png or FILE.svg."


def play(
    problem: Annotated[str, typer.Argument(help="Problem, such as disbanding; with --trust also module:attribute.")],
    attacker: Attacker = None,
    defender: Defender = None,
    preset: Preset = None,
    config: Config = None,
    overrides: Changes = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first episode; the others count up.")] = 0,
    episodes: Annotated[int, typer.Option(min=1, help="Play so many episodes, as one batch.")] = 1,
    render: Annotated[str | None, typer.Option(help=RENDER)] = None,
    fps: Annotated[float, typer.Option(help="Show so many frames per second of film.")] = 10.0,
    speed: Annotated[
        float | None,
        typer.Option(help="Show so many game seconds per second of film; default: 10, and more for long GIFs."),
    ] = None,
    record: Annotated[Path | None, typer.Option(metavar="FILE.csv", help=RECORD)] = None,
    at: Annotated[float | None, typer.Option(help="Draw the picture at this game second; default: the end.")] = None,
    explain: Annotated[bool, typer.Option("--explain", help="Say what each metric means.")] = False,
    as_json: AsJson = False,
) -> None:
    """Play one attacker against one defender: print the metrics, or film the episode."""
    found = find_problem(problem)
    chosen, values = described(found, preset, config, overrides)
    preset = chosen or found.usual_preset
    usual = found.opponents[preset]
    pair = (attacker or usual["attacker"], defender or usual["defender"])
    film = Film(render, fps, speed, at) if render is not None else None
    show_meeting(Meeting(Venue(problem, preset, values), *pair, episodes, seed), film, record, as_json, explain)
