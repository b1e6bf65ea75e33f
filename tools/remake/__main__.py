"""`python -m tools.remake`: the shipped policies made anew, each by the command in its card."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from cps_agents.commands.options import AsJson, Jobs
from cps_agents.console import note, out, print_json
from cps_agents.sheet import Sheet
from cps_agents.zoo.card import SHIPPED
from cps_agents.zoo.files import read_pair
from tools.command import run
from tools.remake.steps import compare, do, steps


def remake(
    names: Annotated[list[str] | None, typer.Argument(help="Shipped policies; default: all.")] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the commands and what they cost, and stop.")
    ] = False,
    folder: Annotated[Path, typer.Option("--to", help="Write the policies to this folder.")] = Path("zoo"),
    runs: Annotated[Path, typer.Option("--out", help="Write runs to this folder, and continue those in it.")] = Path(
        "runs"
    ),
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Make the shipped policies anew, each by the command in its card.

    Training comes first, then self-play, whose final mixed strategies are policies too. All of it takes hours. Press
    Ctrl-C at any time: the same command continues. At the end of each, a line says whether the shipped policy came out.
    """
    planned = steps(names or ())
    if as_json:
        print_json([asdict(step) for step in planned])
    elif dry_run:
        total = sum(step.cpu_s for step in planned) / 60
        rows = [(", ".join(step.policies), f"{step.cpu_s / 60:.1f}", step.command) for step in planned]
        out().print(Sheet("What makes the zoo", ("policies", "CPU min, at least", "command"), rows))
        out().print(f"{len(planned)} commands, at least {total:.0f} CPU minutes in all.")
        out().print("The cards say what it took until the networks that were chosen; runs go on beyond them.")
    for step in () if dry_run else planned:
        note(f"$ {step.command}")
        shipped = [read_pair(SHIPPED / f"{name}.json") for name in step.policies]
        do(step, runs, folder, jobs)
        for each in shipped:
            note(compare(each, folder))


if __name__ == "__main__":
    run(remake, "python -m tools.remake")
