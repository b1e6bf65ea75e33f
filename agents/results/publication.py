"""Putting results into the repository: `docs/results.json`, `docs/results.md` and the table of the README."""

from __future__ import annotations

import json
from pathlib import Path

from agents.errors import CommandError
from agents.files import write_json, write_text
from agents.results.document import Document, merged
from agents.results.markdown import END, START, results_markdown, with_table
from cps_envs import PROBLEMS


def publish(new: Document, root: Path) -> list[Path]:
    """Renew the files below `root` for the problems of the document; the others stay. Returns their paths.

    Raises:
        CommandError: results of a quick look, or no repository of this package.
    """
    if new["quick"]:
        raise CommandError("--quick is a look, no result: publish without it")
    data, page, readme = root / "docs" / "results.json", root / "docs" / "results.md", root / "README.md"
    if not readme.is_file() or START not in (text := readme.read_text(encoding="utf-8")):
        raise CommandError(f"{readme} has no section between {START} and {END}: publish from the repository's folder")
    before = json.loads(data.read_text(encoding="utf-8")) if data.is_file() else None
    document = merged(before, new, list(PROBLEMS))
    write_json(data, document)
    write_text(page, results_markdown(document))
    write_text(readme, with_table(text, document))
    return [data, page, readme]
