"""`cps-envs warm`: compile the kernels ahead."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Annotated

import typer

from cps_agents.commands.options import AsJson, Jobs
from cps_agents.console import note, out, print_json
from cps_agents.machine import available_cores
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet
from cps_agents.warm import Visit, Warmed, visits
from cps_agents.warm import warm as warm_up
from cps_agents.workers import Workers
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.compute.shipped import NATIVE
from cps_envs.core.game.problem import Problem

FAILED = 1


def warm(
    only: Annotated[list[str] | None, typer.Option("--problem", help="Compile this one; may be repeated.")] = None,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Compile all physics now, so that no later command has to wait for it.

    Every preset, adapter and policy of a problem is used for a moment.
    What was compiled before is loaded, so a second call takes seconds.
    Kernels of cps-envs-kernels do not count: those made here are faster.
    Press Ctrl-C at any time: finished kernels are kept.

    Exit codes: 0 all kernels are there; 1 something failed or could
    not be kept; 2 wrong input.
    """
    found = _warm(_problems(only or []), jobs or available_cores())
    kept = all(each.kept for each in found)
    if as_json:
        print_json({"problems": [asdict(each) for each in found], "kept": kept})
    else:
        rows = [(each.problem, str(each.uses), str(each.compiled), f"{each.cpu_s:.1f}") for each in found]
        out().print(Sheet("Kernels", ("Problem", "Uses", "Compiled", "CPU s"), rows))
    for each in found:
        for failure in each.failed:
            note(f"{each.problem}, {failure}")
    if not kept or any(each.failed for each in found):
        raise typer.Exit(FAILED)


def _problems(names: list[str]) -> list[Problem]:
    """The problems that are named; by default all of them."""
    return [find_problem(name) for name in names or PROBLEMS]


def _warm(problems: list[Problem], jobs: int) -> list[Warmed]:
    """Warm each problem, in processes of their own if there are several problems and several are allowed."""
    todo = [(problem.name, list(visits(problem))) for problem in problems]
    done, total = 0, sum(len(uses) for _, uses in todo)
    found = {}
    with Progress("warm", total) as progress, Workers(jobs, len(todo)) as workers:
        progress.say(f"{total} presets, adapters and policies of {', '.join(name for name, _ in todo)}")

        def report(visit: Visit) -> None:
            nonlocal done
            progress.update(done, f"{visit.problem}, {visit.what}")
            done += 1

        alone = partial(_one, report=report)  # in this process: it can tell more
        for (name, _), warmed in workers.run(alone if len(todo) == 1 or jobs == 1 else _one, todo):
            progress.say(f"{name}: {warmed.compiled} kernels compiled in {warmed.cpu_s:.0f} CPU s")
            found[name] = warmed
            progress.update(done := sum(each.uses for each in found.values()))
    return [found[name] for name, _ in todo]


def _one(item: tuple[str, list[Visit]], report: Callable[[Visit], None] = lambda visit: None) -> Warmed:
    os.environ[NATIVE] = "1"
    return warm_up(*item, report)
