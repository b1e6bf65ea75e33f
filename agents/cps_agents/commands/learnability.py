"""`cps-envs learnability`: whether an ordinary learner learns each role, beside everything else that plays it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cps_agents.commands.options import MEETINGS, AsJson, Jobs, Meetings, conclude
from cps_agents.console import out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import write_text
from cps_agents.machine import available_cores
from cps_agents.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cps_agents.learning.ordinary import Lesson

NAMES = (
    *("RogueAttack", "RogueDefense", "FdiAttack", "FdiDefense"),
    *("HvacAttack", "HvacDefense", "DisbandingAttack", "DisbandingDefense"),
)


def learnability(
    role: Annotated[list[str] | None, typer.Argument(help="Roles such as RogueAttack; default: all eight.")] = None,
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Train so many seeds of each role.")] = 5,
    budget: Annotated[float, typer.Option(min=1, metavar="SECONDS", help="Train each seed for this CPU time.")] = 120.0,
    episodes: Annotated[int, typer.Option(min=0, help="Judge on so many episodes; 0: what a role needs.")] = 0,
    held_out: Annotated[bool, typer.Option(help="Judge against an opponent that training does not meet, too.")] = True,
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

    Prints what the models reach beside doing nothing, random play, their own start, the best constant action, and the
    best registered policies. Ctrl-C loses no finished model, and the same command continues. The models are read with
    pickle, so write `cps-envs --trust learnability`.
    """
    from cps_agents.arena.store import Store
    from cps_agents.learning.learnability import HELD_OUT, judge, table, to_json
    from cps_agents.learning.ordinary import Lesson
    from cps_envs.core.errors import near
    from cps_envs.core.trust import require_trust

    names = list(dict.fromkeys(role or NAMES))
    for name in names:
        if name not in NAMES:
            raise CommandError(f"there is no role {name!r}. {near(name, NAMES)}")
    require_trust(f"sb3:{to}")
    workers = jobs or available_cores()
    lessons = [Lesson(name, seed, budget, to / name / f"seed-{seed}") for seed in range(seeds) for name in names]
    cpu_s = _teach(lessons, workers)
    store = Store(meetings)
    found, unmet = [], []
    with Progress("roles judged", len(names)) as progress:
        for place, name in enumerate(names):
            progress.update(place, name)
            found.append(judge(name, to / name, store, workers, episodes=episodes))
            if held_out:
                unmet.append(judge(name, to / name, store, workers, opponent=HELD_OUT[name], episodes=episodes))
        progress.update(len(names))
    if as_json:
        print_json({"budget_s": budget, "cpu_s": cpu_s, "usual": to_json(found), "held_out": to_json(unmet)})
        return
    tables = [table(found, cpu_s, "Ordinary learners against the opponents of preset learning")]
    if unmet:
        tables.append(table(unmet, cpu_s, "The same models against opponents that training has not met"))
    for each in tables:
        out().print(each)
    if markdown is not None:
        parts = ("\n".join((f"**{each.title}**", "", *each.markdown(), "", *each.caption, "")) for each in tables)
        write_text(markdown, "\n".join(parts))
    conclude([] if markdown is None else [markdown])


def _teach(lessons: Sequence[Lesson], workers: int) -> dict[str, float]:
    """Train what is not trained yet; the mean CPU seconds of each role."""
    from cps_agents.learning.ordinary import teach
    from cps_baselines.workers import Workers

    left = [lesson for lesson in lessons if not lesson.done]
    spent: dict[str, list[float]] = {}
    with Progress("models trained", len(lessons)) as progress, Workers(min(workers, max(len(left), 1))) as pool:
        done = len(lessons) - len(left)
        progress.update(done)
        for lesson, run in pool.run(teach, left):
            done += 1
            progress.update(done, f"{lesson.name}, seed {lesson.seed}: training return {run['training_return']}")
        for lesson in lessons:
            spent.setdefault(lesson.name, []).append(teach(lesson)["cpu_s"])
    return {name: sum(values) / len(values) for name, values in spent.items()}
