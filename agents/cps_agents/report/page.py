"""The folder of a report: one page with everything that draws, and a file for each episode."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.files import write_text

SCRIPTS = ("tools.js", "episode.js", "tracks.js", "player.js", "charts.js", "matrix.js", "pair.js", "main.js")
EPISODES = "episodes"


def write_page(folder: Path, content: Mapping[str, Any]) -> Path:
    """Write `index.html`, which shows the content and loads nothing from anywhere else.

    Raises:
        CommandError: the folder cannot be written.
    """
    parts = {
        "title": escape(str(content["title"])),
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
    """JSON that no text in it can end."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False).replace("</", "<\\/").replace("<!--", "<\\!--")
