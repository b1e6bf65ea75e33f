"""Tables and figures are found by the numbers that the dissertation gives them, and a chapter begins with a summary."""

from __future__ import annotations

import io
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from cps_agents.errors import CommandError
from cps_paper.commands.numbers import by_number
from cps_paper.commands.readings import summarize
from cps_paper.exhibit import ExhibitTable, places


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("4.2", "ch4 --table 4.2"),
        ("ch4.2 --quick", "ch4 --table 4.2 --quick"),
        ("table 4.2 --json", "ch4 --table 4.2 --json"),
        ("fig 4.2", "ch4 --table 4.2fig"),
        ("4.2fig", "ch4 --table 4.2fig"),
        ("Fig. 5.7", "ch5 --part maps"),
        ("figure 2.5", "testbed"),
        ("section 2.2.1", "ch2 --table 2.2.1"),
        ("4.3", "ch4 --table 4.3fig"),
        ("ch4 --table 4.2", "ch4 --table 4.2"),
        ("all", "all"),
        ("4.2x", "4.2x"),
        ("", ""),
    ],
)
def test_a_number_means_its_chapter_and_part(written: str, meant: str) -> None:
    assert by_number(written.split()) == meant.split()


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("9.9", "no table or figure or section 9.9"),
        ("fig 3.4", "chapter 3 has Figure 3.1, Figure 3.2"),
        ("table", "reproduce table 4.2"),
        ("fig 2.4", "it lives in file paper/cps_paper/testbed/robots/game.py"),
    ],
)
def test_a_number_that_nothing_computes_says_what_there_is(written: str, said: str) -> None:
    with pytest.raises(CommandError, match=said):
        by_number(written.split())


def test_a_summary_counts_the_verdicts_of_every_table() -> None:
    rows = [("a", "match"), ("b", "near"), ("c", "partly"), ("d", "not reproduced"), ("e", "by construction")]
    columns = places("cell", "verdict")
    tables = {"4.1": [ExhibitTable("Table 4.1", columns, rows)], "4.2fig": [ExhibitTable("Fig. 4.2", columns, [])]}
    found: Any = SimpleNamespace(
        chapter=SimpleNamespace(title="chapter 4"),
        reading="controller clip",
        exhibits=[SimpleNamespace(name=name) for name in tables],
        tables_of=lambda exhibit: tables[exhibit.name],
        closing=lambda: ["Not reproducible: the rest."],
    )
    page = io.StringIO()
    summarize(Console(file=page, width=80), found)
    lines = [line.split() for line in page.getvalue().splitlines()]
    assert ["4.1", "Table", "4.1", "1", "2", "1", "1"] in lines
    assert ["4.2fig", "Fig.", "4.2", "-", "-", "-", "-"] in lines
    assert "Not reproducible: the rest." in page.getvalue()
