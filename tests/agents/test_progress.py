"""Progress where there is no terminal: a line now and then, also while nothing is counted yet."""

from __future__ import annotations

import io
import time

import pytest
from rich.console import Console

from cps_agents import progress
from cps_agents.progress import Progress


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
        deadline = time.monotonic() + 10
        while written.getvalue().count("\n") < 3 and time.monotonic() < deadline:
            time.sleep(0.01)
    lines = written.getvalue().splitlines()
    assert len(lines) >= 3
    assert all(line.startswith("search: 1/4 after") and line.endswith("tracker") for line in lines)
