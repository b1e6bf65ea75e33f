"""A report: leagues with episodes to watch, learning curves and the paper beside ours, in one folder.

It is one page with everything that draws, and a file for each episode. A server for this machine only shows it in the
browser.
"""

from __future__ import annotations

import json
import re
import webbrowser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from html import escape
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any

from cps_agents.arena.play import Report as Told
from cps_agents.arena.play import silent
from cps_agents.console import note
from cps_agents.errors import CommandError
from cps_agents.files import write_text
from cps_agents.machine import describe
from cps_agents.report.board import Board, document
from cps_agents.report.replay import Take, record
from cps_agents.sheet import Sheet
from cps_agents.workers import Where, Workers

SCRIPTS = ("tools.js", "episode.js", "tracks.js", "player.js", "charts.js", "matrix.js", "pair.js", "main.js")
EPISODES = "episodes"


def write_page(folder: Path, content: Mapping[str, Any]) -> Path:
    """Write `index.html`, which shows the content and loads nothing from anywhere else.

    Raises:
        CommandError: the folder cannot be written.
    """
    parts = {
        "title": escape(str(content["title"]).encode("utf-8", "replace").decode()),
        "style": _part("style.css"),
        "script": "\n".join(map(_part, SCRIPTS)),
        "content": _embedded(content),
    }
    page = re.sub("@(title|style|script|content)@", lambda found: parts[found[1]], _part("page.html"))
    return _written(folder / "index.html", page)


def write_episode(folder: Path, key: str, packed: str) -> Path:
    """Write an episode as a script that hands itself to the page, which reads no other file without a server."""
    return _written(folder / EPISODES / f"{key}.js", f'receiveEpisode("{key}","{packed}");\n')


def _written(path: Path, text: str) -> Path:
    try:
        write_text(path, text)
    except OSError as error:
        raise CommandError(f"the report cannot be written: {error}. Choose another folder with --out") from error
    return path


def _part(name: str) -> str:
    return files("cps_agents.report").joinpath("page", name).read_text(encoding="utf-8")


def _embedded(content: Mapping[str, Any]) -> str:
    """JSON in which no text can begin or end a tag or a comment: each `<` stands as its escape."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", r"\u003c")


HOST = "127.0.0.1"


class Quiet(SimpleHTTPRequestHandler):
    """Serves files without printing a line for each request."""

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def serve(folder: Path) -> None:
    """Serve a folder until Ctrl-C, on a free port, and open it in a browser if there is one."""
    with ThreadingHTTPServer((HOST, 0), partial(Quiet, directory=str(folder))) as server:
        address = f"http://{HOST}:{server.server_address[1]}/"
        if not webbrowser.open(address):
            note("No browser was found on this machine: open the address below in one.")
        note(f"Serving {folder} at {address}. Press Ctrl-C to stop.")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            note("Stopped.")


MOST_BYTES, LEAST_BYTES = 9_000_000, 60_000  # of all episodes, and of one that is long
PAPER = ("The paper beside ours", "What the dissertation prints, beside what this code computes.")
TITLE = "Attack and defence of cyber-physical systems"


@dataclass(frozen=True)
class Report:
    """What the pages of a report show."""

    boards: Sequence[Board] = ()
    replays: int = 1  # episodes of each pair that can be watched
    curves: Sequence[dict[str, Any]] = ()
    sheets: Sequence[Sheet] = ()
    about_sheets: tuple[str, str] = PAPER  # heading and first sentence
    title: str = TITLE
    facts: Sequence[str] = field(default_factory=tuple)


def write_report(report: Report, folder: Path, workers: Where = 1, told: Told = silent) -> Path:
    """Record the episodes and write the page; returns its path.

    The page comes first, so that a folder that cannot be written is told before anything is played.

    Raises:
        CommandError: the folder cannot be written.
    """
    takes = [board.takes(report.replays) for board in report.boards]
    content = {
        "title": report.title,
        "facts": [f"cps-envs {describe()['versions']['cps-envs']}", *report.facts],
        "boards": [document(board, chosen) for board, chosen in zip(report.boards, takes, strict=True)],
        "curves": list(report.curves),
        "sheets": [sheet.to_json() for sheet in report.sheets],
        "about_sheets": report.about_sheets,
        "foot": "Written by cps-envs. This page loads nothing from the network.",
    }
    page = write_page(folder, content)
    every = [take for chosen in takes for group in chosen.values() for take in group]
    room = MOST_BYTES // max(len(every), 1)
    _record([replace(take, most_bytes=max(room, LEAST_BYTES)) for take in every], folder, workers, told)
    return page


def _record(takes: Sequence[Take], folder: Path, workers: Where, told: Told) -> None:
    with Workers(workers, len(takes)) as pool:
        for done, (take, episode) in enumerate(pool.run(record, takes), start=1):
            write_episode(folder, take.key, episode)
            told(done, len(takes), take.label)
