"""`python -m tools.bench`: the speed of environments and opponents beside what the project promises."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Annotated, Any, TypeAlias

import typer

from cps_agents.commands.options import AsJson
from cps_agents.console import note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet, styled
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.errors import near
from tools.bench import opponents
from tools.bench.interfaces import OPPONENT, RESETS
from tools.bench.measuring import Findings, measure
from tools.bench.row import Row
from tools.bench.suite import MAKERS, judge, plan
from tools.command import run

PROGRAM = "python -m tools.bench"
QUICK_S, USUAL_S = 0.06, 1.0
Only = Annotated[list[str] | None, typer.Option("--problem", help="Measure this one; may be repeated.")]
Parts = Annotated[
    list[str] | None, typer.Option("--part", help=f"Measure this part: {', '.join(MAKERS)}; may be repeated.")
]
Seconds = Annotated[float, typer.Option(min=0.01, help="Give each row so many CPU seconds.")]
Quick = Annotated[bool, typer.Option("--quick", help=f"Take a look: --seconds {QUICK_S}.")]
Cell: TypeAlias = Callable[[Row], str]
Columns: TypeAlias = Mapping[str, tuple[str, tuple[tuple[str, Cell], ...]]]  # part -> title, columns


def bench(
    only: Only = None,
    parts: Parts = None,
    seconds: Seconds = USUAL_S,
    quick: Quick = False,
    as_json: AsJson = False,
) -> None:
    """Measure the speed of environments and opponents.

    Every time is CPU time of this process. Press Ctrl-C at any time: what was
    measured until then is printed.
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
        for table in tables([_by_problem(row) for row in found.rows]):
            console.print(table)
        if targets:
            console.print(_targets(targets))
        console.print(yardsticks(found, machine))
    if found.interrupted:
        note(f"Interrupted: {len(found.rows)} of {len(items)} rows were measured.")
        raise typer.Exit(found.interrupted)


def _parts(chosen: Sequence[str]) -> Sequence[str]:
    for part in chosen:
        if part not in MAKERS:
            raise CommandError(f"--part {part!r}: there is no such part. {near(part, MAKERS)}")
    return chosen or list(MAKERS)


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


def number(key: str, form: str = ",.1f", factor: float = 1.0) -> Cell:
    """A value of a row, times a factor; a dash where there is none."""
    return lambda row: format(factor * row.values[key], form) if key in row.values else "-"


def _limit(row: Row) -> str:
    """Of the speed that counted operations allow."""
    return f"{row.values['reached']:.0%}" if row.values.get("reached") else "-"


COLUMNS: Columns = {
    "sizes": (
        "Sizes: substeps in a vector of 64; memory of an episode",
        (
            ("M/s", number("work_per_s", factor=1e-6)),
            ("ns each", number("substep_ns", ".3g")),
            ("of its limit", _limit),
            ("us/step", number("step_us")),
            ("kB", number("episode_kb")),
        ),
    ),
    "interfaces": (
        f"Interfaces: against {OPPONENT}",
        (
            ("steps/s", number("steps_per_s", ",.0f")),
            ("us/step", number("step_us", ".3g")),
            ("CartPoles", number("cartpoles", ".3g")),
        ),
    ),
    RESETS: ("Seeded resets of 1,024 environments, each", (("us", number("reset_us", ".3g")),)),
    "added": (
        "What interfaces add to a decision of one environment",
        (
            ("game, us", number("game_us")),
            ("single adds", number("single_us")),
            ("vector adds", number("vector_us")),
        ),
    ),
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
}


def tables(rows: Sequence[Row]) -> list[object]:
    """A table for each part that was measured, and the reasons of rows without figures below."""
    found: list[object] = []
    for part, (title, columns) in COLUMNS.items():
        if own := [row for row in rows if row.part == part]:
            cells = [(_label(row), *(cell(row) for _, cell in columns)) for row in own if row.values]
            found.append(Sheet(title, ("", *(name for name, _ in columns)), cells))
            found += [f"{row.name}: {row.note}" for row in own if not row.values]
    return found


def _label(row: Row) -> str:
    return f"{row.name} ({row.note})" if row.note else row.name


def yardsticks(found: Findings, machine: dict[str, Any]) -> str:
    """The yardsticks that everything was measured by, and the machine."""
    lines = [f"{machine['cpu']}, Python {machine['python']}; CPU time of one process, the best of several rounds."]
    lines += [
        f"A step of a single CartPole takes {each.cartpole_us:.1f} us. The simplest vehicle in a compiled loop makes "
        f"{each.updates_per_s / 1e9:.2f}e9 steps/s of seven operations, and a loop of divisions "
        f"{each.divisions_per_s / 1e9:.2f}e9/s."
        for each in found.yardsticks[:1]
    ]
    return "\n".join(lines)


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
