"""`python -m tools.census`: what it counts, and that every place that it names is there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cps_agents.sheet import plain
from tools import counting
from tools.census import KEPT, Figure, cleared, figures
from tools.counting import ROOT, classes_of, files_at, inner_imports, listed_below, toctrees, words_of

SOURCE = """
import os

class Outer:
    class Inner:
        def find(self):
            import json
            from re import sub
            return lambda: json.dumps(sub)

os.path.join("a", os.path.join("b"))
"""


def written(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def test_classes_and_inner_imports_are_counted(tmp_path: Path) -> None:
    file = written(tmp_path / "source.py", SOURCE)
    assert classes_of(file) == ["Outer", "Inner"]
    assert inner_imports(file) == 2


def test_a_circle_is_found_once_and_types_make_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(counting, "PACKAGES", {"mine": tmp_path / "mine"})
    written(tmp_path / "mine" / "one.py", "from mine import two\n")
    written(tmp_path / "mine" / "two.py", "import mine.three\ndef late():\n    from mine.four import FOUR\n")
    written(tmp_path / "mine" / "three.py", "from mine.one import ONE\n")
    written(
        tmp_path / "mine" / "four.py", "if TYPE_CHECKING:\n    from mine.one import ONE\nfrom mine.two import TWO\n"
    )
    loaded, any_time = counting.circles(inside=False), counting.circles(inside=True)
    assert loaded == [{"mine.one", "mine.two", "mine.three"}]
    assert any_time == [{"mine.one", "mine.two", "mine.three", "mine.four"}]


def test_words_are_those_that_a_reader_reads(tmp_path: Path) -> None:
    notebook = {
        "cells": [{"cell_type": "markdown", "source": ["Two words"]}, {"cell_type": "code", "source": ["x = 1"]}]
    }
    written(tmp_path / "below.ipynb", json.dumps(notebook))
    written(tmp_path / "all.md", "Included, too.")
    page = written(
        tmp_path / "index.md",
        "Three plain words.\n```python\nnot = these\n```\n```{include} all.md\n```\n"
        "```{toctree}\n:caption: Part\n:hidden:\n\nbelow\n```\n",
    )
    assert words_of(page) == 5
    assert words_of(tmp_path / "below.ipynb") == 2
    assert toctrees(page) == [("Part", [tmp_path / "below.ipynb"])]
    assert listed_below(page) == [page, tmp_path / "below.ipynb"]


def test_a_place_that_has_moved_is_an_error() -> None:
    with pytest.raises(FileNotFoundError, match="say where it has moved"):
        files_at("nowhere/*.py")


@pytest.mark.parametrize(("wanted", "reached", "said"), [(5, 5, "met"), (5, 6, "missed"), (None, 6, ""), (5, None, "")])
def test_a_figure_says_whether_it_is_met(wanted: int | None, reached: int | None, said: str) -> None:
    assert plain(Figure("lines", 9, wanted, reached).verdict) == said


@pytest.mark.slow
def test_every_figure_of_this_repository_can_be_counted() -> None:
    found = figures()
    assert len({each.what for each in found}) == len(found) > 20
    assert all(each.reached is not None for each in found if "--tests" not in each.what)


def test_what_was_to_go_is_gone_or_has_a_user() -> None:
    found = dict(cleared())
    assert {what for what, said in found.items() if said != "gone"} == set(KEPT)
    assert all((ROOT / path).exists() for path in KEPT)
