"""`cps-envs list`: what there is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer

from cps_agents.console import out, print_json
from cps_agents.table import Cell, Table, styled


def list_everything(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PROBLEM]...", help="Show only these problems, such as hvac; default: all."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Show the problems, with their environments, presets and policies."""
    from cps_agents.catalogue import describe_everything, describe_problem
    from cps_envs import find_problem

    problems = [describe_problem(find_problem(name)) for name in names] if names else describe_everything()
    if as_json:
        print_json(problems)
        return
    console = out()
    for problem in problems:
        console.print(f"[bold]{problem['name']}[/]: {problem['summary']}\n")
        console.print(Table("Environments", ("Interface", "Id"), _environments(problem), left=2))
        for role, policies in problem["policies"].items():
            rows = [(policy["name"], _remark(policy)) for policy in policies]
            console.print(Table(f"Policies: {role}", ("Name", "What it does"), rows, left=2))
    console.print("An oracle knows more than it observes. With --trust a policy can also be named as module:attribute.")


def _environments(problem: Mapping[str, Any]) -> Sequence[tuple[str, str]]:
    rows = [(f"gymnasium, {role}", name) for role, name in problem["gymnasium"].items()]
    rows += [(f"gymnasium, {role}, Discrete", name) for role, name in problem["discrete"].items()]
    rows += [(f"pettingzoo, {form}", name) for form, name in problem["pettingzoo"].items()]
    return [*rows, ("presets", ", ".join(problem["presets"]))]


def _remark(policy: Mapping[str, Any]) -> Cell:
    if policy["missing"]:
        from cps_envs.core.errors import extra_of

        extra = extra_of(policy["missing"])
        return styled(f'needs {policy["missing"]}: pip install "cps-envs[{extra}]"', "yellow")
    if policy["privileged"]:
        return styled(f"(oracle: {', '.join(policy['privileged'])})", "magenta", f"{policy['summary']} ")
    return str(policy["summary"])
