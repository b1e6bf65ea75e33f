"""`cps-envs report`: leagues, episodes, learning curves and the paper's tables in the browser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.commands.league import MOST
from cps_agents.commands.options import (
    MEETINGS,
    AtCluster,
    Attackers,
    Changes,
    Config,
    Defenders,
    Fresh,
    Jobs,
    Meetings,
    Preset,
    conclude,
    described,
    kept,
    workers,
)
from cps_agents.errors import CommandError
from cps_agents.files import alone_in
from cps_agents.league.league import asked
from cps_agents.progress import Progress
from cps_agents.report.board import Board, kept_board, play_board
from cps_agents.report.report import Report, write_report
from cps_agents.report.report import serve as serve_folder
from cps_agents.report.sources import read_curves, read_sheets
from cps_agents.workers import Where
from cps_envs import PROBLEMS, find_problem
from cps_envs.core.errors import require
from cps_envs.core.types import Role

EPISODES, QUICK_PLAYERS = 20, 3


def report(
    problems: Annotated[list[str] | None, typer.Argument(help="Problems, such as hvac; all if left out.")] = None,
    attacker: Attackers = None,
    defender: Defenders = None,
    preset: Preset = None,
    config: Config = None,
    overrides: Changes = None,
    episodes: Annotated[int, typer.Option(min=1, max=MOST, help="Play so many episodes of each pair.")] = EPISODES,
    replays: Annotated[int, typer.Option(min=0, help="Episodes of each pair that can be watched.")] = 1,
    runs: Annotated[
        list[Path] | None, typer.Option(metavar="DIR", help="Learning curves of training runs; may be repeated.")
    ] = None,
    paper: Annotated[
        list[Path] | None, typer.Option(metavar="DIR", help="Tables of `reproduce --csv DIR`; may be repeated.")
    ] = None,
    folder: Annotated[Path, typer.Option("--out", help="Where the page and its episodes go.")] = Path("results/report"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Three players of each role who can all meet: a first look.")
    ] = False,
    only_kept: Annotated[bool, typer.Option("--kept", help="Show finished meetings only; play none.")] = False,
    serve: Annotated[bool, typer.Option("--serve", help="Serve the page and open it in a browser.")] = False,
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    fresh: Fresh = False,
) -> None:
    """Write a page to open in a browser: who beats whom, and episodes to watch.

    The page needs neither a server nor the network: open index.html in the
    folder. Click a pair of the matrix to watch its episodes.
    """
    require("scipy", extra="baselines", purpose="a report")
    if cluster is not None and only_kept and not replays:
        raise CommandError("--kept --replays 0 plays nothing: there is no work for --cluster, leave it out")
    curves, sheets = read_curves(runs or []), read_sheets(paper or [])
    references: dict[Role, list[str]] = {"attacker": attacker or [], "defender": defender or []}
    venues = []
    for name in problems or list(PROBLEMS):
        found = find_problem(name)
        chosen, values = described(found, preset, config, overrides)
        venues.append(Venue(name, chosen or found.usual_preset, values))
    with alone_in(folder):
        store, where = kept(meetings, fresh=fresh), workers(jobs, cluster)
        tables = [asked(venue, references, episodes) for venue in venues]
        boards = [
            _board(each, references, store, where, only_kept, QUICK_PLAYERS if quick else None) for each in tables
        ]
        with Progress("episodes to watch", 1) as progress:
            page = write_report(Report(boards, replays, curves, sheets), folder, where, progress.report)
    missing = sum(board.missing for board in boards)
    unplayed = [f"{missing} pairs have not been played and are marked."] if missing else []
    conclude([page], store, *unplayed, *([] if serve else ["Open the page in a browser; --serve does."]))
    if serve:
        serve_folder(folder)


def _board(
    table: Table,
    references: Mapping[Role, Sequence[str]],
    store: Store,
    where: Where,
    only_kept: bool,
    most: int | None,
) -> Board:
    if only_kept:
        return kept_board(table, store)
    with Progress(f"{table.venue.problem} pairs", 1) as progress:
        return play_board(table, references, store, where, progress.report, most)
