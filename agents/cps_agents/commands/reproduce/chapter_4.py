"""`cps-envs reproduce ch4`: sensor attacks on heating, and moving target defence."""

from __future__ import annotations

from typing import Annotated

import typer

from cps_agents.commands.reproduce.showing import AsJson, Folder, Jobs, show

PART = "Only this part: 4.1, 4.2, 4.2fig to 4.8fig, early or claims; may be repeated."
RECHECK = "Judge the claims again over days of other seeds; takes twice as long."
CONTROLLER = "How (4.17) keeps its limits: clip, qp or levels."
QUICK = "Leave out Table 4.2 and eight sensors (Fig. 4.8), both with their claims, and attacks before step 200."


def chapter_4(
    table: Annotated[list[str] | None, typer.Option(metavar="PART", help=PART)] = None,
    quick: Annotated[bool, typer.Option("--quick", help=QUICK)] = False,
    recheck: Annotated[bool, typer.Option("--recheck", help=RECHECK)] = False,
    controller: Annotated[str, typer.Option(help=CONTROLLER)] = "clip",
    jobs: Jobs = None,
    plot: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Heating under sensor attacks: Tables 4.1 and 4.2, Figs. 4.2 to 4.8 and every claim of the text.

    Claims and cells that differ from the paper are findings and do not fail. The exit code is 1 when our own numbers
    left the reference values of the specification, which means that the simulation has changed.
    """
    from functools import partial

    from cps_baselines.hvac.reproduction.chapter import CHAPTER

    parts = CHAPTER.chosen(table or [], quick=quick, recheck=recheck)
    CHAPTER.evidence(controller=controller)
    compute = partial(CHAPTER.reproduce, parts, quick=quick, recheck=recheck, controller=controller)
    show("chapter 4", lambda jobs, report: compute(jobs=jobs, report=report), jobs=jobs, plot=plot, as_json=as_json)
