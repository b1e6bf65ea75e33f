"""The document on a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from cps_agents.console import make_table
from cps_agents.results.document import Document
from cps_agents.results.judging import MISSING, NOT_REACHED, ON_AVERAGE, REACHED
from cps_agents.results.markdown import simulations
from cps_agents.results.tables import Block, bar_lines, best_baseline, cautions, heading, judged_against, score_text

if TYPE_CHECKING:
    from cps_agents.table import Table

STYLES = {REACHED: "green", ON_AVERAGE: "yellow", NOT_REACHED: "red", MISSING: "dim"}


def tables(document: Document) -> Iterator[Table]:
    """One table for each block."""
    for problem in document["problems"].values():
        for block in problem["blocks"]:
            yield _table(block)


def _table(block: Block) -> Table:
    rows = []
    for row in block["rows"]:
        for each in block["learned"]:
            verdict = row["verdicts"].get(each["name"], "")
            styled = f"[{STYLES[verdict]}]{verdict}[/]" if verdict else ""
            bars = "\n".join(bar_lines(row, each["name"]))
            title = row["title"] if len(block["learned"]) == 1 else f"{row['title']}, {each['title']}"
            rows.append(
                [title, best_baseline(block, row, each["name"]), score_text(block, row, each["name"]), bars, styled]
            )
    columns = ("setting", "best baseline; learned minus it", "learned", "bars", "verdict")
    missing = [f"missing: {', '.join(names)}" for names in block["missing"].values()]
    caption = [heading(block), *judged_against(block), *cautions(block), *simulations(block), *dict.fromkeys(missing)]
    return make_table(block["title"], columns, rows, left=5, caption=caption)
