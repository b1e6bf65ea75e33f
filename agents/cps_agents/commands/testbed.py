"""`cps-envs testbed`: a disbanding defender on the nine simulated robots of section 2.5."""

from __future__ import annotations

from typing import Annotated

import typer

from cps_agents.commands.options import AsJson, Changes
from cps_agents.commands.play import RENDER
from cps_agents.console import assignments
from cps_agents.errors import CommandError

DEFENDER = "Defender of the disbanding problem: a name from `cps-envs list disbanding`."
PERIOD = "Use the paper's mitigation, with this t_s, as the defender. The paper has 0.5 and 1."
ATTACKER = "Attacker of the disbanding problem. Default: the leading platoon at 20 s."


def drive_robots(
    defender: Annotated[str | None, typer.Option(help=f"{DEFENDER} Default: none.")] = None,
    period: Annotated[float | None, typer.Option(metavar="SECONDS", help=PERIOD)] = None,
    attacker: Annotated[str | None, typer.Option(help=ATTACKER)] = None,
    overrides: Changes = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first episode; the others count up.")] = 0,
    episodes: Annotated[int, typer.Option(min=1, help="Play so many episodes, as one batch.")] = 1,
    render: Annotated[str | None, typer.Option(help=RENDER)] = None,
    fps: Annotated[float, typer.Option(help="Show so many frames per second of film.")] = 10.0,
    speed: Annotated[float, typer.Option(help="Show so many seconds of the experiment per second of film.")] = 4.0,
    at: Annotated[float | None, typer.Option(help="Draw the picture at this second; default: the end.")] = None,
    as_json: AsJson = False,
) -> None:
    """Drive nine simulated robots on a circle: three platoons, and the leading one disbands.

    A defender sees the robots as vehicles on a road ten times as large. Collision avoidance acts on all of them, as in
    the disbanding problem. Only the paper's own mitigation (--period) replaces it, once a platoon has disbanded.
    """
    from cps_agents.arena.meeting import Meeting
    from cps_agents.episodes import show_meeting
    from cps_agents.film import Film
    from cps_baselines.arena import Venue
    from cps_baselines.testbed.cases import mitigation
    from cps_envs.testbed.problem import TESTBED

    if period is not None and defender is not None:
        raise CommandError("--period is the paper's mitigation and --defender another one: give one of them")
    preset = "paper" if period is None else "mitigated"
    venue = Venue("cps_envs.testbed.problem:TESTBED", preset, assignments(overrides or []))
    film = Film(render, fps, speed, at) if render is not None else None
    usual = TESTBED.opponents[preset]
    against = mitigation(period, venue.config) if period is not None else defender or usual["defender"]
    meeting = Meeting(venue, attacker or usual["attacker"], against, episodes, seed)
    show_meeting(meeting, film, as_json)
