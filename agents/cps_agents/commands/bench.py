"""`cps-envs bench`: how fast the environments are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.console import err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.table import Table, styled

if TYPE_CHECKING:
    from cps_agents.bench.row import Row
    from cps_agents.bench.suite import Findings

QUICK_S, USUAL_S = 0.06, 1.0
PART = "Measure this part: sizes, threads, interfaces, added, opponents or training."


def bench(
    only: Annotated[list[str] | None, typer.Option("--problem", help="Measure this one; may be repeated.")] = None,
    parts: Annotated[list[str] | None, typer.Option("--part", help=f"{PART} May be repeated.")] = None,
    training: Annotated[bool, typer.Option("--training", help="Measure training, too; needs PyTorch.")] = False,
    seconds: Annotated[float, typer.Option(min=0.01, help="Give each row so many CPU seconds.")] = USUAL_S,
    quick: Annotated[bool, typer.Option("--quick", help=f"Take a look: --seconds {QUICK_S}, below a minute.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Measure the speed of environments, opponents and training.

    Every time is CPU time of this process, but for threads. Press Ctrl-C at any time:
    what was measured until then is printed.
    """
    from cps_agents.bench.suite import judge, measure, plan
    from cps_envs import PROBLEMS, find_problem

    items = plan([find_problem(name) for name in only or PROBLEMS], _parts(parts or [], training))
    with Progress("bench", len(items)) as progress:
        progress.say(f"{len(items)} rows; kernels that are not compiled yet make them longer")
        found = measure(items, QUICK_S if quick else seconds, lambda done, _, note: progress.update(done, note))
    machine, targets = describe(), judge(found.rows)
    if as_json:
        print_json(_document(machine, found, targets))
    else:
        console = out()
        for table in _tables(found.rows):
            console.print(table)
        if targets:
            console.print(_targets(targets))
        console.print(_yardsticks(found, machine))
    if found.interrupted:
        err().print(f"Interrupted: {len(found.rows)} of {len(items)} rows were measured.")
        raise typer.Exit(found.interrupted)


def _parts(chosen: Sequence[str], training: bool) -> list[str]:
    from cps_agents.bench.suite import PARTS, TRAINING
    from cps_envs.core.errors import near, require

    for part in chosen:
        if part not in PARTS:
            raise CommandError(f"--part {part!r}: there is no such part. {near(part, PARTS)}")
    found = list(chosen) or [part for part in PARTS if part != TRAINING]
    if training and TRAINING not in found:
        found.append(TRAINING)
    if TRAINING in found:
        require("stable_baselines3", extra="train", purpose="measuring training")
    return found


def _document(machine: dict[str, Any], found: Findings, targets: Sequence[Any]) -> dict[str, Any]:
    return {
        "machine": machine,
        "yardsticks": [asdict(each) for each in found.yardsticks],
        "rows": [asdict(row) for row in found.rows],
        "targets": [asdict(target) | {"met": target.met} for target in targets],
        "interrupted": bool(found.interrupted),
    }


Cell = Callable[["Row"], str]


def _number(key: str, form: str = ",.1f", factor: float = 1.0) -> Cell:
    return lambda row: format(factor * row.values[key], form) if key in row.values else "-"


COLUMNS: dict[str, tuple[str, tuple[tuple[str, Cell], ...]]] = {  # part -> title, columns
    "sizes": (
        "Sizes: substeps in a vector of 64; memory of an episode",
        (
            ("M/s", _number("work_per_s", factor=1e-6)),
            ("ns each", _number("substep_ns", ".3g")),
            ("share", _number("machine_share", ".3%")),
            ("us/step", _number("step_us")),
            ("kB", _number("episode_kb")),
        ),
    ),
    "threads": (
        "Threads: steps per second on the wall of an idle machine",
        (
            ("threads", _number("threads", ".0f")),
            ("one", _number("alone_per_s", ",.0f")),
            ("all", _number("together_per_s", ",.0f")),
            ("gain", _number("speed_up", ".2f")),
        ),
    ),
    "interfaces": (
        "Interfaces: against none",
        (
            ("steps/s", _number("steps_per_s", ",.0f")),
            ("us/step", _number("step_us", ".3g")),
            ("CartPoles", _number("cartpoles", ".3g")),
        ),
    ),
    "added": (
        "What interfaces add to a decision of one environment",
        (
            ("game, us", _number("game_us")),
            ("single adds", _number("single_us")),
            ("vector adds", _number("vector_us")),
        ),
    ),
    "opponents": (
        "Opponents: cost of a decision of the other role",
        (
            ("us, 1 env", _number("us_1")),
            ("x none", _number("times_none_1", ".2f")),
            ("us, 64", _number("us_64")),
            ("x none", _number("times_none_64", ".2f")),
        ),
    ),
    "training": (
        "Training: decisions per CPU second",
        (
            ("recipe", _number("steps_per_s", ",.0f")),
            ("defaults", _number("default_steps_per_s", ",.0f")),
            ("ratio", _number("ratio", ".1f")),
        ),
    ),
}


def _tables(rows: Sequence[Row]) -> list[object]:
    """A table for each part that was measured, and the reasons of rows without figures below."""
    tables: list[object] = []
    for part, (title, columns) in COLUMNS.items():
        for group, own in _groups([row for row in rows if row.part == part]).items():
            cells = [(_label(row, group), *(cell(row) for _, cell in columns)) for row in own if row.values]
            tables.append(Table(f"{title}{group and f', {group}'}", ("", *(name for name, _ in columns)), cells))
            tables += [f"{row.name}: {row.note}" for row in own if not row.values]
    return tables


def _groups(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows by problem where their names are long, which those of policies are: `problem.role.policy`."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row.name.partition(".")[0] if row.part == "opponents" else "", []).append(row)
    return groups


def _label(row: Row, group: str) -> str:
    name = row.name.removeprefix(f"{group}.").replace(".", " ", 1) if group else row.name
    return f"{name} ({row.note})" if row.note else name


def _targets(targets: Sequence[Any]) -> object:
    rows = [
        (
            target.what,
            f"{'>=' if target.at_least else '<='} {target.bound:g}",
            f"{target.measured:.3g}",
            styled("met", "green") if target.met else styled("not met", "red"),
        )
        for target in targets
    ]
    return Table("Targets", ("", "wanted", "measured", ""), rows)


def _yardsticks(found: Findings, machine: dict[str, Any]) -> str:
    lines = [f"{machine['cpu']}, Python {machine['python']}; CPU time of one process, the best of several rounds."]
    lines += [
        f"A step of a single CartPole takes {each.cartpole_us:.1f} us. The simplest vehicle in a compiled loop makes "
        f"{each.updates_per_s / 1e9:.2f}e9 steps/s; shares are of that."
        for each in found.yardsticks[:1]
    ]
    return "\n".join(lines)
