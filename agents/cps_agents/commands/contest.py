"""`cps-envs contest`: is a problem's game worth learning, and how far from the best possible is each policy?"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cps_agents.commands.options import MEETINGS, AsJson, Fresh, Jobs, Meetings, conclude
from cps_agents.console import err, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import alone_in, write_figure, write_json, write_text
from cps_agents.machine import available_cores, describe
from cps_agents.progress import Progress

if TYPE_CHECKING:
    from cps_agents.arena.store import Store
    from cps_agents.contest.document import Document
    from cps_agents.contest.jobs import Effort
    from cps_baselines.contest import Contest, Variant

FAILED = 1  # exit code where a rule does not hold


def contest(
    problem: Annotated[list[str] | None, typer.Argument(help="Problems, such as hvac; default: all.")] = None,
    variant: Annotated[list[str] | None, typer.Option(help="Judge only this variant; may be repeated.")] = None,
    budget: Annotated[float, typer.Option(min=1, help="Search for so many CPU seconds against each defender.")] = 300.0,
    episodes: Annotated[int, typer.Option(min=0, help="Episodes of each pair; 0: as the contest says.")] = 0,
    folder: Annotated[Path, typer.Option("--out", help="Write files to this folder.")] = Path("contest"),
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    quick: Annotated[bool, typer.Option("--quick", help="Take a quick look, with few episodes; no result.")] = False,
    fresh: Fresh = False,
    publish: Annotated[bool, typer.Option("--publish", help="Renew docs/contest.md and contest.json here.")] = False,
    as_json: AsJson = False,
) -> None:
    """Check that both sides of a game have something to win.

    Every policy plays every policy of the other side. So do the best
    constant action, attacks that are searched against each defender, and
    references that are told what the others have to infer.

    The first variant is judged by four rules: no constant action is best,
    something can be done, something is left to infer, and nobody has won.
    The exit code is 1 when a rule does not hold.

    Press Ctrl-C at any time: finished work is kept, and the same command
    continues.
    """
    from cps_agents.arena.store import Store
    from cps_agents.contest.contest import choose_variants, find_contests
    from cps_agents.contest.jobs import Effort
    from cps_agents.contest.tables import publish as put
    from cps_envs import find_problem
    from cps_envs.core.errors import require

    if publish and quick:
        raise CommandError("--quick is a look, no result: leave out --publish")
    require("cma", extra="baselines", purpose="a contest's searches")
    require("matplotlib", extra="baselines", purpose="a contest's heat map")
    contests = find_contests([find_problem(name).name for name in problem or []])
    chosen = [(each, one) for each in contests for one in choose_variants(each, variant or [])]
    effort = Effort(4.0, 8, 1, 8, 2, 2, 16) if quick else Effort(budget, episodes)
    found = []
    with alone_in(folder):
        store = Store(meetings, fresh=fresh)
        for each, one in chosen:
            found.append(_play(each, one, effort, store, jobs))
            if not as_json:
                _show(found[-1])
        files = [*_write(found, folder), *(put(found, Path()) if publish else [])]
    if as_json:
        print_json(found)
    if quick:
        err().print("--quick: few episodes and short searches; these are no results.")
    conclude(files)
    broken = [each["problem"] for each in found if each["holds"] is False]
    if broken and not quick:
        err().print(f"Not a contest by every rule: {', '.join(broken)}.")
        raise typer.Exit(FAILED)


def _play(each: Contest, one: Variant, effort: Effort, store: Store, jobs: int | None) -> Document:
    from cps_agents.contest.contest import play_contest
    from cps_agents.contest.document import document

    started = time.monotonic()
    with Progress(f"{each.problem} {one.name}", 1) as progress:
        played = play_contest(each, one, effort, store, jobs or available_cores(), progress.report)
    conclude([], played.reused)
    return document(played, effort, describe(), time.monotonic() - started)


def _write(found: list[Document], folder: Path) -> list[Path]:
    from cps_agents.contest.tables import draw, markdown

    files = [folder / "contest.json", folder / "contest.md"]
    write_json(files[0], found)
    write_text(files[1], "\n".join(map(markdown, found)))
    for each in found:
        files.append(folder / f"{each['problem']}-{each['variant']}.png")
        write_figure(files[-1], draw(each))
    return files


def _show(found: Document) -> None:
    from cps_agents.contest.tables import tables, value_line

    console = out()
    for table in tables(found):
        console.print(table)
    for note in ([value_line(found)] if found["game"] else []) + found["notes"]:
        console.print(note, markup=False)
