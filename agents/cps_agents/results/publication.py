"""Putting results into the repository: `docs/results.json`, `docs/results.md`, the README's table, the cards."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.results.document import Document, merged
from cps_agents.results.examination import declared_blocks
from cps_agents.results.report import BEGIN, END, START, readme_table, results_markdown, with_table
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_agents.zoo.merging import without_places
from cps_agents.zoo.references import PREFIX
from cps_envs.core.documents import read_entry, read_text

RECORDED = ("mean", "low", "high", "seeds", "episodes")


def write(found: Document, folder: Path) -> list[Path]:
    """The document, its page and its table for the README, as files in a folder. Returns their paths."""
    files = [folder / "results.json", folder / "results.md", folder / "README-table.md"]
    write_json(files[0], found)
    write_text(files[1], results_markdown(found))
    write_text(files[2], readme_table(found) + "\n")
    return files


def publish(new: Document, root: Path) -> list[Path]:
    """Renew the files below `root` for the blocks of the document; the others stay. Returns their paths.

    Raises:
        CommandError: results of a quick look, or no repository of this package.
        DamagedFileError: the kept results are damaged.
    """
    if new["quick"]:
        raise CommandError("--quick is a look, no result: publish without it")
    data, page, readme = root / "docs" / "results.json", root / "docs" / "results.md", root / "README.md"
    if not readme.is_file() or not BEGIN.search(text := read_text(readme)):
        raise CommandError(f"{readme} has no section between {START} and {END}: publish from the repository's folder")
    before = published(data) if data.is_file() else None
    problems = {
        name: {"blocks": [{**block, "command": without_places(block["command"])} for block in problem["blocks"]]}
        for name, problem in new["problems"].items()
    }
    document = merged(before, {**new, "problems": problems}, declared_blocks())
    write_json(data, document)
    write_text(page, results_markdown(document))
    write_text(readme, with_table(text, document))
    return [data, page, readme, *(record(policy, new) for policy in shipped_names())]


def published(path: Path) -> Document:
    """What a file of results holds, by problem.

    Raises:
        DamagedFileError: it is no such file.
    """
    found = read_entry(path, "file of results", "Take it from the repository again.")
    for problem in found["problems"].entries().values():
        problem["blocks"].rows()
    return found.plain()


def record(name: str, document: Document, folder: Path = SHIPPED) -> Path:
    """Write into a shipped policy's card what it reached, block by block; blocks that the document lacks stay."""
    path = folder / f"{name}.json"
    card = read_card(path)
    found = {
        block["name"]: {
            row["title"]: {"metric": row["metric"]} | {key: row["scores"][each["name"]][key] for key in RECORDED}
            for row in block["rows"]
            if each["name"] in row["scores"]
        }
        for problem in document["problems"].values()
        for block in problem["blocks"]
        for each in block["learned"]
        if each["policy"] == f"{PREFIX}{name}"
    }
    write_json(path, replace(card, evaluation={**card.evaluation, **found}).to_json())
    return path
