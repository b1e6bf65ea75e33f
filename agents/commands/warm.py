"""`cps-envs warm`: compile the kernels ahead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from agents.console import err, make_table, out, print_json

if TYPE_CHECKING:
    from agents.warm import Warmed
    from cps_envs.core.problem import Problem

FAILED = 1


def warm(
    only: Annotated[list[str] | None, typer.Option("--problem", help="Compile this one; may be repeated.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compile all kernels now, so that nothing has to wait for them later.

    Every preset, interface and policy of a problem is used for a moment.
    What was compiled before is loaded, so a second call takes seconds.
    Press Ctrl-C at any time: finished kernels are kept.

    Exit codes: 0 all kernels are there; 1 something failed or could
    not be kept; 2 wrong input.
    """
    from dataclasses import asdict

    from cps_envs.core.kernel_cache import NOTICE, UNKEPT, told

    told.add(NOTICE)  # this command says what it does
    found = _warm(_problems(only or []))
    kept = UNKEPT not in told
    if as_json:
        print_json({"problems": [asdict(each) for each in found], "kept": kept})
    else:
        rows = [(each.problem, str(each.uses), str(each.compiled), f"{each.cpu_s:.1f}") for each in found]
        out().print(make_table("Kernels", ("Problem", "Uses", "Compiled", "CPU s"), rows))
    for each in found:
        for failure in each.failed:
            err().print(f"{each.problem}, {failure}", soft_wrap=True, markup=False)
    if not kept or any(each.failed for each in found):
        raise typer.Exit(FAILED)


def _problems(names: list[str]) -> list[Problem]:
    """Those that are named, by default all of them, the test bed too."""
    from cps_envs import PROBLEMS, find_problem
    from cps_envs.testbed.problem import TESTBED

    if not names:
        return [*PROBLEMS.values(), TESTBED]
    return [TESTBED if name == TESTBED.name else find_problem(name) for name in names]


def _warm(problems: list[Problem]) -> list[Warmed]:
    from agents.progress import Progress
    from agents.warm import Warmed, visits
    from agents.warm import warm as use

    todo = [(Warmed(problem.name), list(visits(problem))) for problem in problems]
    done, total = 0, sum(len(uses) for _, uses in todo)
    with Progress("warm", total) as progress:
        for found, uses in todo:
            progress.say(f"{found.problem}: {len(uses)} presets, interfaces and policies")
            for visit in uses:
                progress.update(done, f"{found.problem}, {visit.what}")
                use(found, visit)
                done += 1
            progress.say(f"{found.problem}: {found.compiled} kernels compiled in {found.cpu_s:.0f} CPU s")
        progress.update(done)
    return [found for found, _ in todo]
