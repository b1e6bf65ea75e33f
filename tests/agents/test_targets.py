"""The table of targets in docs/learning.md says what the published tables and the cards say."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cps_agents.zoo.card import SHIPPED, read_card

ROOT = Path(__file__).parents[2]
HEADING = "## What was asked and what was reached"
NUMBER = r"[+-]?\d+(?:\.\d+)?"
FIGURE = re.compile(rf"({NUMBER}) \(({NUMBER}) to ({NUMBER})\)")
JUDGED = re.compile(r"cps-envs zoo judge ([\w-]+)")
LINK = "]("  # to commands or to a page: they say more than the tables
Figure = tuple[float, ...]  # mean and both ends of its interval


def published() -> dict[str, Any]:
    """Every published table by its name."""
    kept = json.loads((ROOT / "docs" / "results.json").read_text(encoding="utf-8"))
    return {block["name"]: block for problem in kept["problems"].values() for block in problem["blocks"]}


TABLES = published()


def targets() -> Iterator[tuple[str, str, str, str]]:
    """Role, what was asked, what was reached and where that stands, row by row; `the same` is written out."""
    page = (ROOT / "docs" / "learning.md").read_text(encoding="utf-8")
    table = page.partition(HEADING)[2].partition("\n| role |")[2].partition("\n\n")[0]
    role = where = ""
    for line in table.splitlines()[2:]:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        role = role if cells[0] == "the same" else cells[0]
        where = cells[3].replace("the same", where)
        yield role, cells[1], cells[2], where


def known_in(where: str) -> list[Figure]:
    """The figures of the tables and the judged cards that a row names."""
    tables = [block for name, block in TABLES.items() if f"`{name}`" in where]
    judged = [read_card(SHIPPED / f"{name}.json").exploitability for name in JUDGED.findall(where)]
    found = [figure for block in tables for row in block["rows"] for figure in figures_of(row)]
    return found + [figure_of(each[paid]) for each in judged for paid in ("pay", "searched_pay")]


def figures_of(row: dict[str, Any]) -> Iterator[Figure]:
    """What everybody reached in a row of a published table, differences and bars; shares also in percent."""
    differences = [each for mine in row["differences"].values() for each in mine.values()]
    for each in (*row["scores"].values(), *differences, *row["judgements"]):
        if each["low"] is not None:
            yield figure_of(each)
            yield tuple(100.0 * value for value in figure_of(each))


def figure_of(found: dict[str, float]) -> Figure:
    """Mean and interval of a published number."""
    return found["mean"], found["low"], found["high"]


def says(text: tuple[str, ...], figure: Figure) -> bool:
    """Whether the numbers of a text are those of a figure, at the digits that the text has."""
    return all(
        abs(float(each) - value) <= 0.501 * 10.0 ** -len(each.partition(".")[2])
        for each, value in zip(text, figure, strict=True)
    )


CHECKED = [row for row in targets() if FIGURE.search(row[2]) and LINK not in row[3]]


@pytest.mark.parametrize(("role", "asked", "reached", "where"), CHECKED, ids=[f"{row[0]}: {row[1]}" for row in CHECKED])
def test_each_figure_of_a_target_is_published(role: str, asked: str, reached: str, where: str) -> None:
    known = known_in(where)
    gone = [text[0] for text in FIGURE.finditer(reached) if not any(says(text.groups(), each) for each in known)]
    assert not gone, f"{role}, {asked}: {', '.join(gone)} is not what {where} says"


def test_the_table_was_found() -> None:
    assert len(CHECKED) >= 25


def test_a_figure_that_changed_is_found() -> None:
    assert says(("15.02", "14.74", "15.23"), (15.0213, 14.7391, 15.2344))
    assert not says(("15.02", "14.74", "15.23"), (15.0313, 14.7391, 15.2344))
