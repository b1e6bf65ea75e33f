from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest

from tests.agents import command_line
from tools.bench import against, before, sizes, worker
from tools.bench.__main__ import bench
from tools.bench.sizes import Size
from tools.command import program

PROGRAM = program(against.against)
CHECKOUT = str(against.HERE)


class Told:
    """A side whose measurements are known: the older checkout has no row of threads."""

    costs: ClassVar[dict[str, Iterator[float]]]
    turns: ClassVar[list[str]]

    def __init__(self, folder: Path) -> None:
        self.name = "now" if self.turns else "before"
        self.turns.append(f"{self.name} begins")

    def ask(self, **question: Any) -> Any:
        if not question:
            return [["sizes", "rogue 5 vehicles"], ["threads", "rogue vector 64"]]
        self.turns.append(self.name)
        if question["part"] == "threads":
            return {"speed_up": 1.5} if self.name == "now" else None
        return {"substep_ns": next(self.costs[self.name])}

    def end(self) -> None:
        self.turns.append(f"{self.name} ends")


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> type[Told]:
    Told.costs = {"before": iter((9.0, 8.0)), "now": iter((4.0, 5.0))}
    Told.turns = []
    monkeypatch.setattr(against, "Side", Told)
    for module in (against, before):
        monkeypatch.setattr(module, "PATH", tmp_path / "before.json")
    return Told


def test_rows_are_measured_in_turns_and_the_best_of_each_side_counts(told: type[Told]) -> None:
    result = command_line.succeeded(CHECKOUT, "--rounds", "2", program=PROGRAM)
    assert told.turns[2:6] == ["before", "now", "now", "before"]
    assert told.turns[-2:] == ["before ends", "now ends"]
    sizes_row, threads_row = (line.split() for line in result.stdout.splitlines() if "rogue" in line)
    assert sizes_row[-3:] == ["8", "4", "0.50"]
    assert threads_row[-3:] == ["-", "1.5", "-"]
    assert not before.published()["rows"]


@pytest.mark.usefixtures("told")
def test_what_is_published_is_a_column_of_the_bench(monkeypatch: pytest.MonkeyPatch) -> None:
    command_line.succeeded(CHECKOUT, "--rounds", "2", "--publish", program=PROGRAM)
    found = before.published()
    assert found["rows"]["sizes: rogue 5 vehicles"] == {"before": 8.0, "now": 4.0}
    assert len(found["commit"]) >= 8
    monkeypatch.setattr(sizes, "SIZES", (Size("rogue", "5 vehicles"),))
    shown = command_line.invoke("--part", "sizes", "--seconds", "0.01", "--problem", "rogue", program=program(bench))
    assert "before" in shown.stdout


def test_a_folder_that_is_no_checkout_and_an_unknown_part_are_refused(tmp_path: Path) -> None:
    assert "no checkout" in command_line.refusal(str(tmp_path), program=PROGRAM)
    assert "sizes, resets, threads" in command_line.refusal(CHECKOUT, "--part", "learning", program=PROGRAM)


def test_a_side_that_ends_is_said(tmp_path: Path) -> None:
    """An empty package cps_envs there: the process cannot import what it measures."""
    (tmp_path / "cps_envs").mkdir()
    (tmp_path / "cps_envs" / "__init__.py").touch()
    assert "measuring process ended" in command_line.refusal(str(tmp_path), program=PROGRAM)


def test_a_worker_answers_lines(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    known = (Size("rogue", "5 vehicles"), Size("rogue", "none", {"num_vehicles": -1}))
    monkeypatch.setattr(sizes, "SIZES", known)
    rows = [{"part": "sizes", "name": f"rogue {size.name}", "seconds": 0.01} for size in known]
    worker.know_old_names()
    worker.work(io.StringIO("\n".join(json.dumps(question) for question in ({}, *rows))))
    names, measured, refused = map(json.loads, capsys.readouterr().out.splitlines())
    assert ["sizes", "rogue 5 vehicles"] in names
    assert measured["substep_ns"] > 0
    assert refused is None
