"""`python -m tools.fdi.certify`: improve the certificates that ship, by more than `cps-envs certify` tries."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from cps_agents.commands.certify import certify_tasks, tasks_named
from cps_agents.commands.options import AsJson, Changes, Jobs
from cps_agents.console import assignments
from cps_agents.machine import available_cores
from cps_envs.fdi.problem import FDI
from tools.command import run
from tools.fdi.search import search


def certify(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="Write this file and continue from it.")],
    preset: Annotated[str, typer.Option(help="Use this preset of the problem fdi, such as paper.")] = "paper",
    settings: Changes = None,
    task: Annotated[
        list[str] | None,
        typer.Option(help="Sensors and target, such as 'x4>4'; may be repeated. Default: every cell of the tables."),
    ] = None,
    time_limit: Annotated[
        float, typer.Option(min=0.0, metavar="SECONDS", help="Time for each integer program; 0: none is solved.")
    ] = 20.0,
    anneal: Annotated[int, typer.Option(min=0, help="Try so many attacks for each task in a local search.")] = 100_000,
    exhaust: Annotated[
        float, typer.Option(min=0.0, metavar="CPU SECONDS", help="Search each open task exhaustively for so long.")
    ] = 20.0,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Improve a file of optima: anneal attacks, solve integer programs, and search what stays open exhaustively.

    Tasks that the file has proved stay as they are. Press Ctrl-C at any time: finished tasks are kept, and the same
    command continues.
    """
    config = FDI.config(preset, assignments(settings or []))
    wider = partial(search, plans=anneal, exhaustive_s=exhaust)
    limits = {"time_limit_s": time_limit, "gap": 0.0, "search": wider, "jobs": jobs or available_cores()}
    certify_tasks(config, tasks_named(task or (), config.num_vehicles), path, **limits, improve=True, as_json=as_json)


if __name__ == "__main__":
    run(certify, "python -m tools.fdi.certify")
