"""`cps-envs bench`: how fast the environments are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.console import make_table, out, print_json

if TYPE_CHECKING:
    from agents.bench.suite import Speed, Target

QUICK_S = 0.2


def bench(
    only: Annotated[list[str] | None, typer.Option("--problem", help="Only this problem; may be repeated.")] = None,
    seconds: Annotated[float, typer.Option(min=0.01, help="CPU seconds for each row.")] = 2.0,
    quick: Annotated[bool, typer.Option("--quick", help=f"The same as --seconds {QUICK_S}.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
) -> None:
    """Measure steps per CPU second of every face, beside Gymnasium's CartPole in the same process."""
    from dataclasses import asdict

    from agents.bench.suite import measure_all
    from agents.machine import describe
    from agents.progress import Progress
    from cps_envs import PROBLEMS, find_problem

    problems = [find_problem(name) for name in only or PROBLEMS]
    with Progress("bench", 1) as progress:

        def report(done: int, total: int, note: str) -> None:
            progress.total = total
            progress.update(done, note)

        found = measure_all(problems, QUICK_S if quick else seconds, report)
    machine = describe()
    if as_json:
        speeds, targets = map(asdict, found["speeds"]), map(asdict, found["targets"])
        print_json({"machine": machine, **found, "speeds": list(speeds), "targets": list(targets)})
        return
    console = out()
    console.print(_speeds(found["speeds"]))
    console.print(_physics(found["physics"]))
    console.print(_added(found["added"]))
    console.print(_targets(found["targets"]))
    console.print(f"{machine['cpu']}, Python {machine['python']}; per CPU second of one core, the best round counts.")
    console.print(
        "A step of a vector environment counts once per environment. Ratios are to CartPole in the same form."
    )


def _speeds(speeds: Sequence[Speed]) -> object:
    columns = ("Environment", "Face", "Envs", "Steps/s", "Decisions/s", "Physics/s", "x CartPole")
    rows = [
        (
            speed.env,
            speed.form,
            str(speed.envs),
            f"{speed.steps_per_s:,.0f}",
            f"{speed.decisions_per_s:,.0f}",
            _work(speed.work_per_s, speed.unit),
            f"{speed.cartpole_ratio:.3g}",
        )
        for speed in speeds
    ]
    return make_table("Environments", columns, rows, left=2)


def _work(per_s: float, unit: str) -> str:
    return f"{per_s / 1e6:.1f} M {unit}" if unit else "-"


def _physics(rows: Sequence[Mapping[str, Any]]) -> object:
    cells = [(row["problem"], str(row["envs"]), _work(row["work_per_s"], row["unit"])) for row in rows]
    return make_table("Physics alone", ("Problem", "Envs", "Physics/s"), cells)


def _added(rows: Sequence[Mapping[str, Any]]) -> object:
    cells = [(row["env"], f"{row['game_us']:.1f}", f"{row['added_us']:.1f}") for row in rows]
    columns = ("Single environment", "Game, us/decision", "Added by the face, us/decision")
    return make_table("What the face adds", columns, cells)


def _targets(targets: Sequence[Target]) -> object:
    rows = [
        (target.what, target.wanted, f"{target.measured:,.1f}", "[green]met[/]" if target.met else "[red]not met[/]")
        for target in targets
    ]
    return make_table("Targets", ("What", "Wanted", "Measured", "Verdict"), rows)
