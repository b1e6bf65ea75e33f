"""`python -m tools.bench`: the speed of environments, opponents and training beside what the project promises."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Annotated, Any

import typer

from cps_agents.bench.measuring import Findings, measure
from cps_agents.bench.row import Row
from cps_agents.bench.tables import OWN, Columns, number, tables, yardsticks
from cps_agents.commands.bench import QUICK_S, USUAL_S, Only, Quick, Seconds
from cps_agents.commands.options import AsJson
from cps_agents.console import note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet, styled
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.errors import near, require
from tools.bench import opponents
from tools.bench.before import published
from tools.bench.suite import LEARNING, PARTS, judge, plan
from tools.command import run

PROGRAM = "python -m tools.bench"
PART = "Measure this part: sizes, resets, threads, interfaces, added, opponents or learning, which needs PyTorch."


def bench(
    only: Only = None,
    parts: Annotated[list[str] | None, typer.Option("--part", help=f"{PART} May be repeated.")] = None,
    seconds: Seconds = USUAL_S,
    quick: Quick = False,
    as_json: AsJson = False,
) -> None:
    """Measure the speed of environments, opponents and training.

    Every time is CPU time of this process, but for threads. Press Ctrl-C at any time:
    what was measured until then is printed.
    """
    items = plan([find_problem(name) for name in only or PROBLEMS], _parts(parts or []))
    with Progress("bench", len(items)) as progress:
        progress.say(f"{len(items)} rows; kernels that are not compiled yet make them longer")
        found = measure(items, QUICK_S if quick else seconds, lambda done, _, note: progress.update(done, note))
    machine, targets = describe(PROGRAM), judge(found.rows, found.yardsticks)
    if as_json:
        print_json(_document(machine, found, targets))
    else:
        console = out()
        for table in tables([_by_problem(row) for row in found.rows], COLUMNS):
            console.print(table)
        if targets:
            console.print(_targets(targets))
        console.print(yardsticks(found, machine))
    if found.interrupted:
        note(f"Interrupted: {len(found.rows)} of {len(items)} rows were measured.")
        raise typer.Exit(found.interrupted)


def _parts(chosen: Sequence[str]) -> list[str]:
    for part in chosen:
        if part not in PARTS:
            raise CommandError(f"--part {part!r}: there is no such part. {near(part, PARTS)}")
    if LEARNING in chosen:
        require("torch", extra="train", purpose="measuring our own PPO")
    return list(chosen) or [part for part in PARTS if part != LEARNING]


def _document(machine: dict[str, Any], found: Findings, targets: Sequence[Any]) -> dict[str, Any]:
    return {
        "machine": machine,
        "yardsticks": [asdict(each) for each in found.yardsticks],
        "rows": [asdict(row) for row in found.rows],
        "targets": [asdict(target) | {"met": target.met} for target in targets],
        "interrupted": bool(found.interrupted),
    }


def _by_problem(row: Row) -> Row:
    """Policies have long names, `problem.role.policy`: each problem has a table of its own."""
    if row.part != opponents.PART:
        return row
    problem, _, name = row.name.partition(".")
    return replace(row, part=f"{row.part} {problem}", name=name.replace(".", " ", 1))


def _before(form: str) -> Any:
    """What a row was at an older commit, see `tools.bench.against`."""
    rows = published()["rows"]

    def cell(row: Row) -> str:
        values = rows.get(f"{row.part}: {row.name}", {})
        return format(values["before"], form) if "before" in values else "-"

    return cell


def _limit(row: Row) -> str:
    """Of the speed that counted operations allow."""
    return f"{row.values['reached']:.0%}" if row.values.get("reached") else "-"


COLUMNS: Columns = {
    "sizes": (
        "Sizes: substeps in a vector of 64; memory of an episode",
        (
            ("M/s", number("work_per_s", factor=1e-6)),
            ("ns each", number("substep_ns", ".3g")),
            ("before", _before(".3g")),
            ("of its limit", _limit),
            ("us/step", number("step_us")),
            ("kB", number("episode_kb")),
        ),
    ),
    "threads": (
        "Threads: steps per second on the wall of an idle machine",
        (
            ("threads", number("threads", ".0f")),
            ("one", number("alone_per_s", ",.0f")),
            ("all", number("together_per_s", ",.0f")),
            ("gain", number("speed_up", ".2f")),
            ("before", _before(".2f")),
        ),
    ),
    "resets": (
        "Resets of 1,024 environments against none: microseconds for each",
        (
            ("seeded", number("reset_us", ".2f")),
            ("before", _before(".1f")),
            ("not seeded", number("again_us", ".2f")),
        ),
    ),
    **OWN,
    **{
        f"{opponents.PART} {problem}": (
            f"Opponents: cost of a decision of the other role, {problem}",
            (
                ("us, 1 env", number("us_1")),
                ("x none", number("times_none_1", ".2f")),
                ("us, 64", number("us_64")),
                ("x none", number("times_none_64", ".2f")),
            ),
        )
        for problem in PROBLEMS
    },
    "learning": (
        "Our own PPO: native decisions per CPU second, and shares of the time in percent",
        (
            ("steps/s", number("steps_per_s", ",.0f")),
            ("environment", number("environment", ".0f", 100)),
            ("opponent", number("opponent", ".0f", 100)),
            ("forward", number("forward", ".0f", 100)),
            ("gradient", number("gradient", ".0f", 100)),
            ("book-keeping", number("book_keeping", ".0f", 100)),
        ),
    ),
}


def _targets(targets: Sequence[Any]) -> object:
    rows = [
        (
            target.what,
            f"{'>=' if target.at_least else '<='} {target.bound:.3g}",
            f"{target.measured:.3g}",
            styled("met", "green") if target.met else styled("not met", "red"),
        )
        for target in targets
    ]
    return Sheet("Targets; microseconds and rates at the speed of this machine", ("", "wanted", "measured", ""), rows)


if __name__ == "__main__":
    run(bench, PROGRAM)
