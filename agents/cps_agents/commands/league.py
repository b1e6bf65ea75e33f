"""`cps-envs league`: everybody against everybody, and the equilibrium."""

from __future__ import annotations

import time
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.arena.venue import Venue
from cps_agents.commands.options import (
    MEETINGS,
    AsJson,
    AtCluster,
    Attackers,
    Changes,
    Config,
    Defenders,
    Fresh,
    Html,
    Jobs,
    Meetings,
    OfPart,
    Preset,
    conclude,
    described,
    kept,
    workers,
)
from cps_agents.console import out, print_json
from cps_agents.files import alone_in, write_figure, write_json, write_text
from cps_agents.league.league import League, asked, play_league
from cps_agents.league.report import document, draw, rows_as_csv, tables, verdict
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.report.board import board_of
from cps_agents.report.report import Report, write_report
from cps_agents.workers import Where
from cps_envs import find_problem
from cps_envs.core.errors import require
from cps_envs.core.types import ROLES, Role

MOST = 1_000_000  # evaluation seeds


def league(
    problem: Annotated[str, typer.Argument(help="Problem, such as hvac.")],
    attacker: Attackers = None,
    defender: Defenders = None,
    oracles: Annotated[
        bool, typer.Option("--oracles", help="`all` includes policies that know more than they observe.")
    ] = False,
    preset: Preset = None,
    config: Config = None,
    overrides: Changes = None,
    episodes: Annotated[
        int, typer.Option(min=1, max=MOST, help="Play so many episodes of each pair, on seeds 0, 1, ...")
    ] = 50,
    metric: Annotated[str, typer.Option(help="Play for this metric; `return` is the attacker's.")] = "return",
    folder: Annotated[Path, typer.Option("--out", help="Write files to this folder.")] = Path("league"),
    html: Html = None,
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    part: OfPart = None,
    fresh: Fresh = False,
    as_json: AsJson = False,
) -> None:
    """Let every attacker play every defender, and solve the zero-sum game between them.

    Strategies are chosen on one half of the episodes and valued on the other. So the value does not favour the side
    with more policies. The interval holds the value of the game between the true means.

    Press Ctrl-C at any time: finished pairs are kept, and the same command continues. Pairs are played again when the
    code, a version, a trained network or the configuration has changed.
    """
    require("scipy", extra="baselines", purpose="a league")
    require("matplotlib", extra="baselines", purpose="a league's heat map")
    game = find_problem(problem)
    chosen, values = described(game, preset, config, overrides)
    venue = Venue(problem, chosen or game.usual_preset, values)
    references: dict[Role, list[str]] = {"attacker": attacker or [], "defender": defender or []}
    started = time.monotonic()
    store, where = kept(meetings, fresh=fresh, part=part), workers(jobs, cluster)
    with alone_in(folder) if part is None else nullcontext():  # parts that end at once write the same
        with Progress(f"{problem} pairs", 1) as progress:
            table = asked(venue, references, episodes, metric)
            found = play_league(table, references, store, where, progress.report, oracles=oracles)
        wall_s = time.monotonic() - started
        files = _write(found, document(found, describe(), wall_s), folder)
        files += [] if html is None else [_page(found, where, html)]
    if as_json:
        print_json(document(found, describe(), wall_s))
    else:
        _show(found)
    conclude(files, store, f"{wall_s:.0f} s.")


def _write(found: League, content: dict[str, Any], folder: Path) -> list[Path]:
    files = [folder / f"{find_problem(found.table.venue.problem).name}.{suffix}" for suffix in ("json", "csv", "png")]
    write_json(files[0], content)
    write_text(files[1], rows_as_csv(found))
    write_figure(files[2], draw(found))
    return files


def _page(found: League, where: Where, folder: Path) -> Path:
    with Progress("episodes to watch", 1) as progress:
        return write_report(Report([board_of(found)]), folder, where, progress.report)


def _show(found: League) -> None:
    console = out()
    for table in tables(found):
        console.print(table)
    console.print(verdict(found), markup=False)
    for (role, reference), reason in found.left_out.items():
        console.print(f"Left out: {role} {reference}: {reason}", markup=False)
    for role in ROLES:
        for each in found.table.players(role):
            if each.overrides:
                console.print(f"{role} {each.name} plays in its own form: {dict(each.overrides)}", markup=False)
