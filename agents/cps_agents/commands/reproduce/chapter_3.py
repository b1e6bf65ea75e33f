"""`cps-envs reproduce ch3`: false data injection."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cps_agents.commands.reproduce.showing import AsJson, Folder, Jobs, show

PART = "Only this part: 3.1 to 3.7, fig or audit; may be repeated."
SET = "Gains, limits and horizons: A or B. The paper prints none; both are fitted to its tables."
BACK_END = "Solver of the cells: highs, scip or cplex."
QUICK = "Only the tables with one attacked vehicle, fig and audit, and fewer control rules."


def chapter_3(
    table: Annotated[list[str] | None, typer.Option(metavar="PART", help=PART)] = None,
    preset_set: Annotated[str, typer.Option(metavar="A|B", help=SET)] = "A",
    back_end: Annotated[str, typer.Option(help=BACK_END)] = "highs",
    time_limit: Annotated[float, typer.Option(metavar="SECONDS", help="Of each solve.")] = 2.0,
    acceptance: Annotated[
        float, typer.Option(help="Largest distance from a grid point that counts as reached.")
    ] = 0.45,
    quick: Annotated[bool, typer.Option("--quick", help=QUICK)] = False,
    audit: Annotated[bool, typer.Option("--audit", help="The same as --table audit.")] = False,
    jobs: Jobs = None,
    plot: Folder = None,
    as_json: AsJson = False,
) -> None:
    """False data injection: Tables 3.1 to 3.7 cell by cell, their contradictions, and Fig. 3.2.

    No table is reproduced as a whole: the individual speeds, Table 3.7, the constants and the colliding pair of
    Fig. 3.2 cannot be, and the last lines say so. Counts of agreement stand beside goals and beside rules that know
    less. The exit code is 1 when a count falls more than 3 below its goal.
    """
    from functools import partial

    from cps_baselines.fdi.reproduction.chapter import CHAPTER

    reading: dict[str, Any] = {
        "preset_set": preset_set,
        "back_end": back_end,
        "time_limit": time_limit,
        "acceptance": acceptance,
    }
    parts = CHAPTER.chosen([*(table or []), *(["audit"] if audit else [])], quick=quick)
    CHAPTER.evidence(**reading)
    compute = partial(CHAPTER.reproduce, parts, quick=quick, **reading)
    show("chapter 3", lambda jobs, report: compute(jobs=jobs, report=report), jobs=jobs, plot=plot, as_json=as_json)
