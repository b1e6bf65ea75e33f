"""The readings of the dissertation that are offered: each chapter, once for each way to settle what it leaves open.

A reproduced chapter is shown on a console, and its figures are written as files.
"""

from __future__ import annotations

import io
import json
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from rich.console import Console

from cps_agents.arena.meeting import Result
from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_agents.files import write_figure, write_text
from cps_agents.sheet import Sheet, plain, styled
from cps_agents.workers import Where
from cps_envs.core.documents import Entry
from cps_envs.core.errors import near
from cps_paper.chapter import Reproduction
from cps_paper.commands.chapters import COMMANDS, Command
from cps_paper.evidence import Report

COLORS = {
    "match": "green",
    "reproduced": "green",
    "near": "yellow",
    "partly": "yellow",
    "miss": "red",
    "not reproduced": "red",
    "by construction": "dim",
    "open": "dim",
    "not evaluated": "dim",
}


def render(console: Console, found: Reproduction[Any]) -> None:
    """Print all tables with their notes, then what is not reproduced and why."""
    for table in found.tables():
        console.print(_colored(table.sheet))
        if not table.notes:
            console.print()
    for paragraph in found.closing():
        console.print(paragraph, markup=False)
        console.print()


AGREEMENT = {"match": "green", "near": "yellow", "miss": "red", "put in": "dim"}
COUNTS = (
    "match: cells that match and claims that are reproduced; near: cells that are near and claims that hold in part; "
    "put in: by construction, or not evaluated; -: nothing of this table is judged.",
)


def summarize(console: Console, found: Reproduction[Any]) -> None:
    """Print a line for each table with how often it agrees, then what is not reproduced and why."""
    rows = []
    for exhibit in found.exhibits:
        for table in found.tables_of(exhibit):
            verdicts = Counter(COLORS[cell] for row in table.rows for cell in row if cell in COLORS)
            counts = (str(verdicts[color]) if verdicts else "-" for color in AGREEMENT.values())
            rows.append([exhibit.name, table.title, *counts])
    title = f"{found.chapter.title}, {found.reading}".capitalize()
    console.print(Sheet(title, ["part", "table", *AGREEMENT], rows, left=2, caption=COUNTS))
    for paragraph in found.closing():
        console.print(paragraph, markup=False)
        console.print()
    console.print("Add --all for every table in full; name a part, or a number of the dissertation, for one.")


def draw(found: Reproduction[Any], folder: Path) -> list[Path]:
    """Write the figures as PNG files; returns their paths."""
    paths = []
    for name, figure in found.figures():
        paths.append(folder / f"{name}.png")
        write_figure(paths[-1], figure)
    return paths


def write_sheets(found: Reproduction[Any], folder: Path) -> list[Path]:
    """Write the tables as CSV files; returns their paths."""
    paths = []
    for name, text in found.sheets():
        paths.append(folder / f"{name}.csv")
        write_text(paths[-1], text)
    return paths


def _colored(sheet: Sheet) -> Sheet:
    words = ((plain(cell) for cell in row) for row in sheet.rows)
    return replace(
        sheet, rows=[[styled(text, COLORS[text]) if text in COLORS else text for text in row] for row in words]
    )


PAGE_WIDTH = 120  # columns of a file with tables


@dataclass(frozen=True)
class ChapterReading:
    """A chapter under one reading, and how much of it is computed."""

    kind: ClassVar[str] = "reading"
    name: str  # "ch2-S0", also of its files
    chapter: str  # "2", or section "2.5"
    problem: str
    quick: bool = False
    recheck: bool = False

    @property
    def label(self) -> str:
        """For progress and file names."""
        return self.name

    def run(self, jobs: Where = 1, report: Report = lambda share, label: None) -> Result:
        """Compute it in so many processes.

        The result has `document` (plain data), `text` (tables), `tallies`, `again` (what changes under the
        conditions of --recheck), `passed` and `wall_s`.
        """
        started = time.monotonic()
        found = self.compute(jobs, report)
        page = io.StringIO()
        render(Console(file=page, width=PAGE_WIDTH, highlight=False), found)
        return {
            "document": json.loads(to_json(found.document())),
            "text": page.getvalue(),
            "tallies": [asdict(each) for each in found.tallies()],
            "again": found.rechecks(),
            "passed": bool(found.passed),
            "wall_s": round(time.monotonic() - started, 1),
        }

    def compute(self, jobs: Where, report: Report) -> Reproduction[Any]:
        """The chapter under this reading."""
        chosen = {self.command.varied: self.choice} if self.choice else {}
        chapter, quick, recheck = self.command.load(), self.quick, self.recheck
        return chapter.reproduce(quick=quick, recheck=recheck, jobs=jobs, report=report, **chosen)

    def check(self, result: Entry) -> None:
        """A document with its tables and tallies."""
        result["document"].entries()
        result["text"].text()
        for tally in result["tallies"].rows():
            tally.entries()
        for row in result["again"].rows():
            row.entries()
        result["wall_s"].number(0)

    @property
    def command(self) -> Command:
        """The command that computes the chapter alone."""
        (found,) = (each for each in COMMANDS if each.number == self.chapter)
        return found

    @property
    def choice(self) -> str:
        """What is chosen, such as "S0"; empty where there is no choice."""
        return self.name.partition("-")[2]


def readings(*, quick: bool, recheck: bool) -> list[ChapterReading]:
    """All of them, in the order of the dissertation."""
    return [
        ChapterReading(f"{each.name}-{value}" if value else each.name, each.number, each.problem, quick, recheck)
        for each in sorted(COMMANDS, key=lambda each: each.number)
        for value in each.values or ("",)
    ]


def chosen(every: Sequence[ChapterReading], names: Sequence[str]) -> list[ChapterReading]:
    """Those with these names; all of them if none is named.

    Raises:
        CommandError: there is no such reading.
    """
    known = [reading.name for reading in every]
    for name in names:
        if name not in known:
            raise CommandError(f"there is no reading {name!r}. {near(name, known)} Known: {', '.join(known)}.")
    return [reading for reading in every if not names or reading.name in names]
