"""`cps-envs list`: what there is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer

from cps_agents.catalogue import describe_problem
from cps_agents.commands.options import AsJson, Preset
from cps_agents.console import out, print_json
from cps_agents.errors import CommandError
from cps_agents.sheet import Cell, Sheet, styled
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.errors import EXTRAS
from cps_envs.core.game.configuration_file import template
from cps_envs.core.policies.lookup import policy_names
from cps_envs.core.types import ROLES

CONFIG = "Write a configuration file with every field of one problem."
PRIVILEGED = "Privileged: knows more than its role observes. "


def show(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[PROBLEM]...", help="Show the policies of these, such as hvac.")
    ] = None,
    config: Annotated[bool, typer.Option("--config", help=CONFIG)] = False,
    preset: Preset = None,
    as_json: AsJson = False,
) -> None:
    """Show the problems and their policies.

    Without a name: the problems, on one screen. With a problem's name: its environments, presets and policies.
    `cps-envs list hvac --config > my_house.toml` writes a file to change, which every command takes with --config.
    """
    if config:
        if len(names or ()) != 1 or as_json:
            raise CommandError("a configuration file is for one problem: cps-envs list PROBLEM --config > FILE.toml")
        typer.echo(template(find_problem((names or [])[0]), preset), nl=False)
        return
    if preset is not None:
        raise CommandError("--preset goes with --config: it says what the configuration file starts from")
    if as_json:
        print_json([describe_problem(each) for each in (map(find_problem, names) if names else PROBLEMS.values())])
    elif names:
        found = [describe_problem(find_problem(name)) for name in names]
        for each in found:
            _show_problem(each)
        knows = any(policy["privileged"] for each in found for role in ROLES for policy in each["policies"][role])
        out().print(f"{PRIVILEGED * knows}With --trust a policy can also be named as module:attribute.")
    else:
        rows = [
            (each.name, each.summary, *(str(len(policy_names(each.name, role))) for role in ROLES))
            for each in PROBLEMS.values()
        ]
        out().print(Sheet("Problems", ("Name", "What happens", "Attackers", "Defenders"), rows, left=2))
        out().print("`cps-envs list hvac` shows a problem's environments, presets and policies.")


def _show_problem(problem: Mapping[str, Any]) -> None:
    console = out()
    console.print(f"[bold]{problem['name']}[/]: {problem['summary']}\n")
    console.print(Sheet("Environments", ("Interface", "Id"), _environments(problem), left=2))
    for role, policies in problem["policies"].items():
        rows = [(policy["name"], _remark(policy)) for policy in policies]
        console.print(Sheet(f"Policies: {role}", ("Name", "What it does"), rows, left=2))


def _environments(problem: Mapping[str, Any]) -> Sequence[tuple[str, str]]:
    rows = [(f"gymnasium, {role}", name) for role, name in problem["gymnasium"].items()]
    rows += [(f"pettingzoo, {form}", name) for form, name in problem["pettingzoo"].items()]
    return [*rows, ("presets", ", ".join(problem["presets"]))]


def _remark(policy: Mapping[str, Any]) -> Cell:
    if policy["missing"]:
        extra = EXTRAS[policy["missing"]]
        return styled(f'needs {policy["missing"]}: pip install "cps-envs[{extra}]"', "yellow")
    known, elsewhere = ", ".join(policy["privileged"]), policy["plays_in"]
    marks = (f"privileged: {known}" if known else "", f"plays {elsewhere}, not learning" if elsewhere else "")
    found = "; ".join(filter(None, marks))
    return styled(f"({found})", "magenta", f"{policy['summary']} ") if found else str(policy["summary"])
