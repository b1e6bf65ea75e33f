"""What the console shows: tables that lose nothing at any width, and progress where there is no terminal."""

from __future__ import annotations

import inspect
import io
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console, ConsoleOptions, RenderResult

from cps_agents import progress
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet, csv_text, fit, parts, plain, styled
from tests.agents.command_line import invoke
from tests.processes import wait_until

WIDTHS = (40, 60, 80)
WORDS = st.text("ab1._", min_size=1, max_size=35)
CELLS = st.lists(WORDS, max_size=4).map(" ".join) | st.lists(WORDS, min_size=2, max_size=3).map("\n".join)
ALONE = ("--jobs", "1")
COMMANDS = [
    ("list",),
    ("play", "disbanding", "--set", "duration_s=2", "--episodes", "12"),
    ("play", "cps_paper.testbed.robots.problem:TESTBED"),
    ("zoo", "list"),
    ("zoo", "show", "disbanding-defense"),
    ("reproduce", "benchmark", "--list"),
    ("evaluate", "rogue", "attacker", "--attacker", "random", "--baseline", "none", "--episodes", "2", *ALONE),
    ("league", "rogue", "--attacker", "random", "--defender", "pd", "--defender", "sliding", "--episodes", "2", *ALONE),
    ("reproduce", "benchmark", "rogue", "--quick", "--table", "solid-1.3", "--attacker", "random", *ALONE),
    ("certify", "--preset", "paper", "--set", "horizon=12", "--task", "x4>1", *ALONE),
    ("reproduce", "ch2", "--table", "2.3fig", *ALONE),
    pytest.param(("reproduce", "testbed", *ALONE), marks=pytest.mark.slow),
]


def printed(table: Sheet, width: int) -> list[str]:
    file = io.StringIO()
    Console(file=file, width=width).print(table)
    return file.getvalue().splitlines()


def read_back(lines: Sequence[str]) -> list[list[str]]:
    """The columns of each part as text without spaces, by the extents of the line below its heads."""
    rules = [i for i, line in enumerate(lines) if "─" in line]
    starts = []
    for rule in rules:
        start = rule
        while start and lines[start - 1]:
            start -= 1
        starts.append(start)
    found = []
    for rule, start, end in zip(rules, starts, [*starts[1:], len(lines)], strict=True):
        extents = [match.span() for match in re.finditer("─+", lines[rule])]
        texts = [*lines[start:rule], *lines[rule + 1 : end]]
        found.append(["".join("".join(line[a:b] for line in texts).split()) for a, b in extents])
    return found


def assert_complete(table: Sheet, width: int) -> None:
    lines = printed(replace(table, title="", caption=(), breaks=()), width)
    assert max(map(len, lines)) <= width
    columns = [
        "".join("".join(map(plain, (head, *(row[i] for row in table.rows)))).split())
        for i, head in enumerate(table.columns)
    ]
    found = read_back(lines)
    assert found == [columns] or any(
        [part[:keys] for part in found] == [columns[:keys]] * len(found)
        and [text for part in found for text in part[keys:]] == columns[keys:]
        for keys in range(1, table.left + 1)
    )


@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_no_command_loses_text_on_a_narrow_terminal(
    arguments: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("highspy")
    tables: list[Sheet] = []
    usual = Sheet.__rich_console__

    def seen(table: Sheet, console: Console, options: ConsoleOptions) -> RenderResult:
        tables.append(table)
        return usual(table, console, options)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Sheet, "__rich_console__", seen)
    result = invoke(*arguments, columns=80)
    assert result.exit_code in (0, 1), result.output  # 1: a verdict
    shown = list(tables)
    assert shown
    for table in shown:
        assert "\n".join(printed(table, 80)) in result.stdout
        for width in WIDTHS:
            assert_complete(table, width)


def test_every_table_of_the_command_line_is_one_of_these() -> None:
    package = Path(inspect.getfile(Sheet)).parent
    assert not [file for file in package.rglob("*.py") if "rich.table import Sheet" in file.read_text(encoding="utf-8")]


@given(st.data(), st.integers(20, 120))
def test_any_table_is_complete_at_any_width(data: st.DataObject, width: int) -> None:
    count = data.draw(st.integers(1, 8))
    heads = data.draw(st.lists(WORDS, min_size=count, max_size=count))
    rows = data.draw(st.lists(st.lists(CELLS, min_size=count, max_size=count), max_size=4))
    assert_complete(Sheet("", heads, rows, left=data.draw(st.integers(1, count))), width)


def test_one_part_where_it_fits_and_the_same_names_in_each_part_elsewhere() -> None:
    table = Sheet("Title", ("name", "first", "second"), [("a", "1", "2"), ("b", "30", "4")], caption=["Below."])
    assert printed(table, 80) == [
        "Title",
        "name  first  second",
        "────  ─────  ──────",
        "a         1       2",
        "b        30       4",
        "",
        "Below.",
        "",
    ]
    assert printed(table, 18)[1] == "name first second"
    assert [line for line in printed(table, 12) if line.startswith("name")] == ["name  first", "name  second"]


def test_columns_that_tell_rows_apart_are_repeated_together() -> None:
    table = Sheet("", ("road", "seed", "value", "bound"), [("x", "1", "5", "6"), ("x", "2", "7", "8")], left=2)
    assert [line for line in printed(table, 19) if "seed" in line] == ["road  seed  value", "road  seed  bound"]


def test_lines_are_drawn_where_rows_end_a_section() -> None:
    lines = printed(Sheet("", ("name",), [("a",), ("b",)], breaks=(0,)), 80)
    assert lines == ["name", "────", "a", "────", "b", ""]


def test_styles_take_no_room_and_brackets_are_text() -> None:
    table = Sheet("[plain]", ("[head]",), [(styled("good", "green", "1\n"),)])
    assert printed(table, 80)[:5] == ["[plain]", "[head]", "──────", "1", "good"]
    file = io.StringIO()
    Console(file=file, width=80, force_terminal=True, color_system="standard").print(table)
    assert "\x1b[32mgood" in file.getvalue()


def test_a_table_in_markdown_and_as_comma_separated_values() -> None:
    table = Sheet("", ("name", "value"), [("a|b", styled("(good)", "green", "1\n"))])
    assert table.markdown() == ["| name | value |", "|---|---|", "| a/b | 1<br>(good) |"]
    assert csv_text(table.columns, [("a,b", None)]) == 'name,value\n"a,b",\n'


def test_the_widest_columns_give_way_first() -> None:
    assert fit((2, 2, 2), (3, 10, 6), 12) == [3, 4, 5]
    assert fit((4, 4), (4, 9), 6) == [4, 4]
    assert [part.columns for part in parts((5, 5, 5), (5, 5, 5), 1, 12)] == [[0, 1], [0, 2]]


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    monkeypatch.setattr(progress, "err", lambda: Console(file=text, width=200))
    monkeypatch.setattr(progress, "LINE_EVERY_S", 0.0)
    return text


def test_a_note_alone_is_news(written: io.StringIO) -> None:
    with Progress("search", 10) as shown:
        shown.update(0, "200 tried")
        shown.update(0, "200 tried")
        shown.update(0, "400 tried")
    lines = written.getvalue().splitlines()
    assert [line.split("  ")[-1] for line in lines] == ["200 tried", "400 tried"]


def test_the_end_is_always_said(written: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "LINE_EVERY_S", 1e9)
    with Progress("pairs", 2) as shown:
        for done in (1, 2, 2):
            shown.update(done, f"{done} done")
    assert [line.split(" after")[0] for line in written.getvalue().splitlines()] == ["pairs: 2/2"]


def test_work_that_reports_nothing_is_not_silent(written: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "SILENCE_S", 0.01)
    with Progress("search", 4) as shown:
        shown.update(1, "tracker")
        assert wait_until(lambda: written.getvalue().count("\n") >= 3)
    lines = written.getvalue().splitlines()
    assert all(line.startswith("search: 1/4 after") and line.endswith("tracker") for line in lines)


def test_a_long_note_gives_way_to_count_and_time(monkeypatch: pytest.MonkeyPatch) -> None:
    text = io.StringIO()
    monkeypatch.setattr(progress, "err", lambda: Console(file=text, width=80, force_terminal=True))
    with Progress("disbanding", 1234) as shown:
        shown.update(1000, "spread against zoo:disbanding-defense-self-play, seeds 1,000,000 to 1,000,400 and more")
    last = re.sub(r"\x1b\[[^a-zA-Z]*[a-zA-Z]", "", text.getvalue()).strip().splitlines()[-1]
    assert len(last) <= 80
    assert "disbanding" in last
    assert "1000/1234" in last
    assert "0:00:0" in last
    assert "spread" in last
