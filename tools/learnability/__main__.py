"""`python -m tools.learnability`: what learned policies reach in each role, beside everything else that plays it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from cps_agents.arena.store import Store
from cps_agents.commands.options import MEETINGS, AsJson, Jobs, Meetings, conclude
from cps_agents.console import out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import write_text
from cps_agents.machine import available_cores
from cps_agents.progress import Progress
from cps_baselines.workers import Workers
from cps_envs.core.errors import near
from cps_envs.core.policies.trust import require_trust
from tools.command import run
from tools.learnability.judging import HELD_OUT, Learned, Reached, judge, table, to_json
from tools.learnability.lessons import Lesson, teach

NAMES = (
    *("RogueAttack", "RogueDefense", "FdiAttack", "FdiDefense"),
    *("HvacAttack", "HvacDefense", "DisbandingAttack", "DisbandingDefense"),
)


def learnability(
    role: Annotated[list[str] | None, typer.Argument(help="Roles such as RogueAttack; default: all eight.")] = None,
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Train so many seeds of each role.")] = 5,
    budget: Annotated[float, typer.Option(min=1, metavar="SECONDS", help="Train each seed for this CPU time.")] = 120.0,
    episodes: Annotated[int, typer.Option(min=0, help="Judge on so many episodes; 0: what a role needs.")] = 0,
    held_out: Annotated[bool, typer.Option(help="Judge against opponents that training does not meet, too.")] = True,
    rivals: Annotated[bool, typer.Option(help="Judge beside every registered policy, too; takes longest.")] = True,
    shipped: Annotated[bool, typer.Option("--shipped", help="Judge the shipped networks instead of training.")] = False,
    to: Annotated[Path, typer.Option("--out", metavar="DIR", help="Keep models and runs here.")] = Path(
        "runs/learnability"
    ),
    markdown: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write the tables to this file, as Markdown.")
    ] = None,
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Train PPO of stable-baselines3 on each role, and judge it beside everything else.

    Prints what the models reach beside doing nothing, random play, their own start, the best constant action, every
    registered policy and one that is told more. Ctrl-C loses no finished model, and the same command continues. The
    models are read with pickle, which needs your consent: CPS_ENVS_TRUST=1. With --shipped nothing is trained.
    """
    names = list(dict.fromkeys(role or NAMES))
    for name in names:
        if name not in NAMES:
            raise CommandError(f"there is no role {name!r}. {near(name, NAMES)}")
    workers, store = jobs or available_cores(), Store(meetings)
    learned = [Learned.shipped(name) for name in names] if shipped else _trained(names, seeds, budget, to, workers)
    questions = [(each, rival) for each in learned for rival in ("", *(HELD_OUT[each.name] if held_out else ()))]
    usual: list[Reached] = []
    unmet: list[Reached] = []
    with Progress("roles judged", len(questions)) as progress:
        for place, (each, rival) in enumerate(questions):
            progress.update(place, f"{each.name} {rival}")
            found = judge(each, store, workers, opponent=rival, episodes=episodes, rivals=rivals)
            (unmet if rival else usual).append(found)
        progress.update(len(questions))
    if as_json:
        print_json({"usual": to_json(usual), "held_out": to_json(unmet)})
        return
    who = "Shipped networks" if shipped else "Ordinary learners"
    tables = [table(usual, f"{who} against the opponents of preset learning")]
    if unmet:
        tables.append(table(unmet, "The same against opponents that training has not met"))
    for shown in tables:
        out().print(shown)
    if markdown is not None:
        parts = ("\n".join((f"**{each.title}**", "", *each.markdown(), "", *each.caption, "")) for each in tables)
        write_text(markdown, "\n".join(parts))
    conclude([] if markdown is None else [markdown])


def _trained(names: Sequence[str], seeds: int, budget: float, to: Path, workers: int) -> list[Learned]:
    """Train what is not trained yet."""
    require_trust(f"sb3:{to}")
    lessons = [Lesson(name, seed, budget, to / name / f"seed-{seed}") for seed in range(seeds) for name in names]
    left = [lesson for lesson in lessons if not lesson.done]
    with Progress("models trained", len(lessons)) as progress, Workers(min(workers, max(len(left), 1))) as pool:
        done = len(lessons) - len(left)
        progress.update(done)
        for lesson, run in pool.run(teach, left):
            done += 1
            progress.update(done, f"{lesson.name}, seed {lesson.seed}: training return {run['training_return']}")
    spent = {name: [teach(lesson)["cpu_s"] for lesson in lessons if lesson.name == name] for name in names}
    return [Learned.in_folder(name, to / name, sum(spent[name]) / len(spent[name])) for name in names]


if __name__ == "__main__":
    run(learnability, "python -m tools.learnability")
