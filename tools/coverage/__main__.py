"""`python -m tools.coverage`: how often do the intervals hold the truth?"""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.commands.options import AsJson, Jobs
from cps_agents.console import note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.machine import available_cores, describe
from cps_agents.progress import Progress
from cps_agents.zoo.merging import without_places
from cps_envs.core.errors import require
from tools.command import run
from tools.coverage.cases import Coverage, all_cases
from tools.coverage.simulation import CHUNK, Effort, document, markdown, simulate, tables
from tools.reliability.store import commit

PROGRAM = "python -m tools.coverage"
QUICK = (100, 200)  # repetitions, resamples


def coverage(
    folder: Annotated[Path, typer.Option("--out", help="Write coverage.json and coverage.md to this folder.")] = Path(
        "coverage"
    ),
    jobs: Jobs = None,
    quick: Annotated[bool, typer.Option("--quick", help="Take a quick look: few repetitions, no result.")] = False,
    publish: Annotated[bool, typer.Option("--publish", help="Renew docs/coverage.md here.")] = False,
    as_json: AsJson = False,
) -> None:
    """Check our statistics: how often do 95 % intervals hold the truth?

    Random data with a known truth are analysed by the functions that every
    table uses: means, interquartile means, several settings, paired
    differences, and values of games.
    """
    if publish and quick:
        raise CommandError("--quick is a look, no result: leave out --publish")
    page = Path("docs") / "coverage.md"
    if publish and not page.parent.is_dir():
        raise CommandError(f"there is no folder {page.parent} here: publish from the repository's folder")
    effort = Effort(*QUICK) if quick else Effort()
    found, machine = _simulate(effort, jobs or available_cores())
    files = [folder / "coverage.json", folder / "coverage.md", *([page] if publish else [])]
    content = document(found, effort, machine)
    write_json(files[0], content)
    for file in files[1:]:
        write_text(file, markdown(found, effort, machine))
    if as_json:
        print_json(content)
    else:
        for table in tables(found):
            out().print(table)
    if quick:
        note("--quick: few repetitions; these are no results.")
    note(f"Written: {', '.join(map(str, files))}")


def _simulate(effort: Effort, workers: int) -> tuple[list[Coverage], dict[str, Any]]:
    """The figures, and by what, when and at what cost they were made."""
    require("scipy", extra="baselines", purpose="coverage")
    cases, made = all_cases(), {**describe(PROGRAM), "commit": commit(), "date": f"{datetime.date.today()}"}
    made["command"] = without_places(made["command"])
    with Progress("coverage", len(cases) * -(-effort.repetitions // CHUNK)) as progress:
        found = simulate(cases, effort, workers, progress.update)
    cpu_s = round(sum(each.cpu_s for each in found), 1)
    return found, {**made, "cpu_s": cpu_s}


if __name__ == "__main__":
    run(coverage, PROGRAM)
