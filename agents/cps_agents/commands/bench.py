"""`cps-envs bench`: how fast the environments are on this machine."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from cps_agents.bench.interfaces import added_items, items
from cps_agents.bench.measuring import measure
from cps_agents.bench.tables import tables, yardsticks
from cps_agents.commands.options import AsJson
from cps_agents.console import note, out, print_json
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_envs import PROBLEMS, find_problem

QUICK_S, USUAL_S = 0.06, 1.0
Only = Annotated[list[str] | None, typer.Option("--problem", help="Measure this one; may be repeated.")]
Seconds = Annotated[float, typer.Option(min=0.01, help="Give each row so many CPU seconds.")]
Quick = Annotated[bool, typer.Option("--quick", help=f"Take a look: --seconds {QUICK_S}, below a minute.")]


def bench(only: Only = None, seconds: Seconds = USUAL_S, quick: Quick = False, as_json: AsJson = False) -> None:
    """Measure how fast the environments are on this machine, in every interface.

    Every time is CPU time of this process. Press Ctrl-C at any time: what was measured until then is printed.
    """
    problems = [find_problem(name) for name in only or PROBLEMS]
    todo = [*items(problems), *added_items(problems)]
    with Progress("bench", len(todo)) as progress:
        progress.say(f"{len(todo)} rows; kernels that are not compiled yet make them longer")
        found = measure(todo, QUICK_S if quick else seconds, lambda done, _, note: progress.update(done, note))
    machine = describe()
    if as_json:
        print_json({"machine": machine, **asdict(found)})
    else:
        for table in tables(found.rows):
            out().print(table)
        out().print(yardsticks(found, machine))
    if found.interrupted:
        note(f"Interrupted: {len(found.rows)} of {len(todo)} rows were measured.")
        raise typer.Exit(found.interrupted)
