"""Hostile learning curves and tables: one sentence that names the file, before anything is played."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.agents.command_line import refusal

needs_posix = pytest.mark.skipif(sys.platform == "win32", reason="pipes and devices of POSIX")
EVIL: dict[str, Callable[[Path], object]] = {
    "pipe": lambda path: os.mkfifo(path),
    "endless": lambda path: path.symlink_to("/dev/zero"),
    "deep": lambda path: path.write_text('{"steps": ' + "[" * 100_000 + "\n"),
    "not a number": lambda path: path.write_text('{"steps": 1, "validation": NaN}\n'),
    "infinite": lambda path: path.write_text('{"steps": 1e999, "validation": 1}\n'),
    "long field": lambda path: path.write_text("a,b\n1," + "x" * 200_000 + "\n"),
    "no text": lambda path: path.write_bytes(b"\xff\xfe\x00"),
    "empty": lambda path: path.write_text(""),
}
TABLES = ("pipe", "endless", "long field", "no text", "empty")


@needs_posix
@pytest.mark.parametrize("kind", [kind for kind in EVIL if kind != "long field"])
def test_a_hostile_curve_is_refused_by_name(kind: str, tmp_path: Path) -> None:
    run = tmp_path / "seed-0"
    run.mkdir()
    EVIL[kind](run / "evaluations.jsonl")
    begun = time.process_time()
    said = refusal("report", "rogue", "--runs", str(tmp_path), "--out", str(tmp_path / "out"))
    assert str(run / "evaluations.jsonl") in said
    assert "train it again" in said or "--resume" in said
    assert not (tmp_path / "out").exists()
    assert time.process_time() - begun < 10.0


@needs_posix
@pytest.mark.parametrize("kind", TABLES)
def test_a_hostile_table_is_refused_by_name(kind: str, tmp_path: Path) -> None:
    EVIL[kind](tmp_path / "table.csv")
    said = refusal("report", "rogue", "--paper", str(tmp_path), "--out", str(tmp_path / "out"))
    assert f"{tmp_path / 'table.csv'} is no table" in said
    assert not (tmp_path / "out").exists()
