"""Putting the summary of all readings into the repository: `docs/reproduction.json` and `docs/reproduction.md`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.reproduction.summary import COUNTED, DEPENDING, Finished, counted, depending
from cps_agents.table import Table
from cps_envs.core.documents import read_text

START = "<!-- the tables below are written by `cps-envs reproduce all --publish` -->"
END = "<!-- the tables above are written by `cps-envs reproduce all --publish` -->"
KEPT = ("chapter", "reading", "tallies", "passed", "wall_s", "recheck", "command")


def publish(every: Sequence[Finished], root: Path) -> list[Path]:
    """Renew both files below `root`; returns their paths.

    Raises:
        CommandError: no repository of this package.
    """
    page, data = root / "docs" / "reproduction.md", root / "docs" / "reproduction.json"
    text = read_text(page) if page.is_file() else ""
    if START not in text or END not in text:
        raise CommandError(f"{page} has no lines {START} and {END}: publish from the repository's folder")
    kept = [{name: each[name] for name in KEPT} for each in every]
    before, after = text.partition(START)[0], text.partition(END)[2]
    write_json(data, kept)
    write_text(page, f"{before}{START}\n\n{tables(kept)}\n{END}{after}")
    return [page, data]


def tables(every: Sequence[Finished]) -> str:
    """The summary as Markdown."""
    return "\n".join(
        [
            *Table("", COUNTED, counted(every)).markdown(),
            "",
            "Claims whose verdict depends on the reading:",
            "",
            *Table("", DEPENDING, depending(every)).markdown(),
            "",
        ]
    )
