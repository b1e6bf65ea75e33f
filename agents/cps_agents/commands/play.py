"""`cps-envs list`, `play` and `testbed`: what there is, and episodes between two policies.

`cps-envs testbed` plays a disbanding defender on the nine simulated robots of section 2.5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer

from cps_agents.commands.options import AsJson, Changes
from cps_agents.console import assignments, out, print_json
from cps_agents.errors import CommandError
from cps_agents.table import Cell, Table, styled

POLICY = "A name from `cps-envs list`, or name?option=value. Default: the preset's own."
RENDER = "Show a window (human), or write FILE.mp4, FILE.gif, FILE.png or FILE.svg."


def play(
    problem: Annotated[str, typer.Argument(help="Problem, such as disbanding; with --trust also module:attribute.")],
    attacker: Annotated[str | None, typer.Option(help=POLICY)] = None,
    defender: Annotated[str | None, typer.Option(help=POLICY)] = None,
    preset: Annotated[str, typer.Option(help="Start from this preset.")] = "paper",
    overrides: Changes = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first episode; the others count up.")] = 0,
    episodes: Annotated[int, typer.Option(min=1, help="Play so many episodes, as one batch.")] = 1,
    render: Annotated[str | None, typer.Option(help=RENDER)] = None,
    fps: Annotated[float, typer.Option(help="Show so many frames per second of film.")] = 10.0,
    speed: Annotated[
        float | None,
        typer.Option(help="Show so many game seconds per second of film; default: 10, and more for long GIFs."),
    ] = None,
    at: Annotated[float | None, typer.Option(help="Draw the picture at this game second; default: the end.")] = None,
    as_json: AsJson = False,
) -> None:
    """Play one attacker against one defender: print the metrics, or film the episode."""
    from cps_agents.arena.meeting import Meeting
    from cps_agents.film import Film, show_meeting
    from cps_baselines.arena import Venue
    from cps_envs import find_problem

    found, values = find_problem(problem), assignments(overrides or [])
    found.config(preset, values)  # which refuses unknown ones
    usual = found.opponents[preset]
    pair = (attacker or usual["attacker"], defender or usual["defender"])
    film = Film(render, fps, speed, at) if render is not None else None
    show_meeting(Meeting(Venue(problem, preset, values), *pair, episodes, seed), film, as_json)


def list_everything(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PROBLEM]...", help="Show only these problems, such as hvac; default: all."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Show the problems, with their environments, presets and policies."""
    from cps_agents.catalogue import describe_everything, describe_problem
    from cps_envs import find_problem

    problems = [describe_problem(find_problem(name)) for name in names] if names else describe_everything()
    if as_json:
        print_json(problems)
        return
    console = out()
    for problem in problems:
        console.print(f"[bold]{problem['name']}[/]: {problem['summary']}\n")
        console.print(Table("Environments", ("Interface", "Id"), _environments(problem), left=2))
        for role, policies in problem["policies"].items():
            rows = [(policy["name"], _remark(policy)) for policy in policies]
            console.print(Table(f"Policies: {role}", ("Name", "What it does"), rows, left=2))
    console.print("An oracle knows more than it observes. With --trust a policy can also be named as module:attribute.")


def _environments(problem: Mapping[str, Any]) -> Sequence[tuple[str, str]]:
    rows = [(f"gymnasium, {role}", name) for role, name in problem["gymnasium"].items()]
    rows += [(f"gymnasium, {role}, Discrete", name) for role, name in problem["discrete"].items()]
    rows += [(f"pettingzoo, {form}", name) for form, name in problem["pettingzoo"].items()]
    return [*rows, ("presets", ", ".join(problem["presets"]))]


def _remark(policy: Mapping[str, Any]) -> Cell:
    if policy["missing"]:
        from cps_envs.core.errors import extra_of

        extra = extra_of(policy["missing"])
        return styled(f'needs {policy["missing"]}: pip install "cps-envs[{extra}]"', "yellow")
    if policy["privileged"]:
        return styled(f"(oracle: {', '.join(policy['privileged'])})", "magenta", f"{policy['summary']} ")
    return str(policy["summary"])


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
    from cps_agents.film import Film, show_meeting
    from cps_baselines.arena import Venue
    from cps_envs.testbed.problem import TESTBED

    if period is not None and defender is not None:
        raise CommandError("--period is the paper's mitigation and --defender another one: give one of them")
    preset = "paper" if period is None else "mitigated"
    venue = Venue("cps_envs.testbed.problem:TESTBED", preset, assignments(overrides or []))
    film = Film(render, fps, speed, at) if render is not None else None
    usual = TESTBED.opponents[preset]
    if period is not None:
        from cps_envs.core.errors import require

        require("cps_paper", extra="paper", purpose="the paper's mitigation")
        from cps_paper.testbed.cases import mitigation

        against = mitigation(period, venue.config)
    else:
        against = defender or usual["defender"]
    meeting = Meeting(venue, attacker or usual["attacker"], against, episodes, seed)
    show_meeting(meeting, film, as_json)
