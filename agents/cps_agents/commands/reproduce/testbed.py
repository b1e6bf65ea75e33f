"""`cps-envs reproduce testbed`: section 2.5, platoon disbanding on nine robots."""

from __future__ import annotations

from typing import Annotated

import typer

from cps_agents.commands.reproduce.showing import AsJson, Folder, Jobs, show

QUICK = "Three seeds unless --seeds says otherwise, and no long runs."


def section_2_5(
    seeds: Annotated[int | None, typer.Option(min=1, help="How many; 20 if left out.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help=QUICK)] = False,
    jobs: Jobs = None,
    plot: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Nine robots on a circle, simulated: the three E_v of Fig. 2.5 and every claim of section 2.5.

    Values that differ from the paper are findings and do not fail. The exit code is 1 when our three E_v leave the
    spread of the specification, or do not fall from case to case in nine of ten seeds: then the simulation has changed.
    """
    from functools import partial

    from cps_baselines.testbed.chapter import CHAPTER

    compute = partial(CHAPTER.reproduce, quick=quick, seeds=seeds)
    show("test bed", lambda jobs, report: compute(jobs=jobs, report=report), jobs=jobs, plot=plot, as_json=as_json)
