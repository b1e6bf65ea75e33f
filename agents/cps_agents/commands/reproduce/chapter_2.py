"""`cps-envs reproduce ch2`: platoon disbanding."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cps_agents.commands.reproduce.showing import AsJson, Folder, Jobs, show

PART = "Only this part: 2.2, 2.3, 2.1fig, 2.3fig, platoons, text, ga or claims; may be repeated."
RECHECK = "Judge the claims again at half the step and under two rules of the text."


def chapter_2(
    table: Annotated[list[str] | None, typer.Option(metavar="PART", help=PART)] = None,
    interpretation: Annotated[str, typer.Option(help="How to read what the paper leaves open: S0, S1, S2.")] = "S0",
    all_interpretations: Annotated[
        bool, typer.Option("--all-interpretations", help="The baseline under S0, S1 and S2 as well.")
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="Leave out long strings, grids, most searches, and what is played.")
    ] = False,
    recheck: Annotated[bool, typer.Option("--recheck", help=RECHECK)] = False,
    jobs: Jobs = None,
    plot: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Platoon disbanding: Tables 2.2 and 2.3, Figs. 2.1 and 2.3, the optimal attacks and every claim of the text.

    `platoons` and `text` play defenders in the environment: for N = 2 to 10, and under what the text only describes.

    Cells that differ from the paper are findings and do not fail. The exit code is 1 when our own numbers left the
    reference values of the specification, which means that the simulation has changed.
    """
    from functools import partial

    from cps_baselines.disbanding.reproduction.chapter import CHAPTER

    reading: dict[str, Any] = {"interpretation": interpretation, "all_interpretations": all_interpretations}
    parts = CHAPTER.chosen(table or [], quick=quick, recheck=recheck)
    compute = partial(CHAPTER.reproduce, parts, quick=quick, recheck=recheck, **reading)
    show("chapter 2", lambda jobs, report: compute(jobs=jobs, report=report), jobs=jobs, plot=plot, as_json=as_json)
