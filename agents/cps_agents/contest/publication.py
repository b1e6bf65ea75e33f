"""Putting contests into the repository: `docs/contest.json` and `docs/contest.md`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cps_agents.contest.contest import find_contests
from cps_agents.contest.document import Document, remarks
from cps_agents.contest.tables import as_markdown, draw, markdown, summary
from cps_agents.errors import CommandError
from cps_agents.files import write_figure, write_json, write_text
from cps_envs.core.documents import read_entry, read_text

END = "<!-- the tables below are written by `cps-envs contest --publish` -->"


def publish(new: Sequence[Document], root: Path) -> list[Path]:
    """Renew both files below `root` for the variants of the documents; other declared ones stay. Returns their paths.

    Raises:
        CommandError: no repository of this package.
        DamagedFileError: the kept documents are damaged.
    """
    page, data = root / "docs" / "contest.md", root / "docs" / "contest.json"
    text = read_text(page) if page.is_file() else ""
    if END not in text:
        raise CommandError(f"{page} has no line {END}: publish from the repository's folder")
    before = _published(data) if data.is_file() else []
    known = {_key(found): found for found in (*before, *new)}
    contests = find_contests([])
    declared = [((each.problem, variant.name), each) for each in contests for variant in each.variants]
    every = [known[key] | remarks(contest) for key, contest in declared if key in known]
    pictures = [_picture(root, found) for found in new if found["searches"]]
    write_json(data, every)
    first = "\n".join(["## All roles", "", *as_markdown(summary(every))]) + "\n"
    write_text(page, "\n".join([text.partition(END)[0] + END, "", first, *map(markdown, every)]))
    return [page, data, *pictures]


def _published(path: Path) -> list[Document]:
    """What a file of contests holds, by problem and variant."""
    rows = read_entry(path, "file of contests", "Take it from the repository again.").rows()
    for row in rows:
        row["problem"].text(), row["variant"].text()
    return [row.plain() for row in rows]


def _key(found: Document) -> tuple[str, str]:
    return found["problem"], found["variant"]


def _picture(root: Path, found: Document) -> Path:
    """The heat map of a judged variant, which its section shows."""
    path = root / "docs" / "images" / f"contest-{found['problem']}.png"
    write_figure(path, draw(found))
    return path
