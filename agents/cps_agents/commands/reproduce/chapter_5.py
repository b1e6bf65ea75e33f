"""`cps-envs reproduce ch5`: a platoon with a vehicle that an attacker drives."""

from __future__ import annotations

from typing import Annotated

import typer

from cps_agents.commands.reproduce.showing import AsJson, Folder, Jobs, show

PART = "5.2, 5.3, 5.4, 5.5, maps, seats, claims, fit or headroom; may be repeated."
RECHECK = "Judge the claims again at half the step and in 20 worlds: 23 times the work."
QUICK = "Leave out seats, fit and headroom, unless they are named."


def chapter_5(
    part: Annotated[list[str] | None, typer.Option(metavar="PART", help=PART)] = None,
    quick: Annotated[bool, typer.Option("--quick", help=QUICK)] = False,
    recheck: Annotated[bool, typer.Option("--recheck", help=RECHECK)] = False,
    jobs: Jobs = None,
    plot: Folder = None,
    as_json: AsJson = False,
) -> None:
    """A rogue vehicle in a platoon: Figs. 5.2 to 5.11, and every claim of the text, with both contacts.

    The paper prints no damage. Its orderings come out of a selected configuration only, and the last lines say how
    selected it is. The exit code is 1 when our own damages left the reference values of the specification, which means
    that the simulation has changed.
    """
    from cps_baselines.reproduction.evidence import Report
    from cps_baselines.reproduction.recheck import require_claims
    from cps_baselines.rogue.reproduction.chapter import Reproduction, reproduce_chapter
    from cps_baselines.rogue.reproduction.parts import chosen

    parts = chosen(part or [], quick=quick)
    if recheck:
        require_claims(parts, "claims", "--part")

    def compute(jobs: int, report: Report) -> Reproduction:
        return reproduce_chapter(parts, jobs=jobs, quick=quick, recheck=recheck, report=report)

    show("chapter 5", compute, jobs=jobs, plot=plot, as_json=as_json)
