"""Rows of learning: their statistics, what they are compared with, and the page, from made-up data."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tools.peers import learning
from tools.peers.learning import PROGRAMS, Program, difference, judged, learn, page, rivals


def test_the_interval_is_that_of_paired_differences() -> None:
    after, other = np.array([3.0, 5.0, 4.0, 8.0]), np.array([1.0, 4.0, 1.0, 6.0])
    mean, half = difference(after, other)
    assert mean == pytest.approx(2.0)
    assert half == pytest.approx(3.182446 * np.sqrt(2 / 3) / 2, rel=1e-6)  # t of 3 degrees of freedom


def paid(level: float) -> list[float]:
    return [level + 0.1 * (i % 3) for i in range(30)]


def test_it_learns_when_the_interval_lies_above_zero() -> None:
    beside = {"random": paid(0.5), "constant": [2.0, 0.1] * 15}
    assert judged({"before": paid(0.5), "after": paid(1.0)}, beside)["learns"]
    assert not judged({"before": paid(0.5), "after": paid(0.2)}, beside)["learns"]


def test_the_page_names_what_learns_and_what_does_not_run() -> None:
    row = {"title": "library PPO", "file": "a_ppo", "role": "FdiAttack", "version": "1.2", "note": ""}
    numbers = judged({"before": paid(0.5), "after": paid(1.0)}, {"random": paid(0.4), "constant": paid(1.5)})
    failed = {"title": "other", "file": "b", "role": "FdiAttack", "note": "wants less", "failed": "pip | went back"}
    text = "\n".join(page({"a": {**row, **numbers}, "b": failed}))
    assert "| library PPO (1.2): `a_ppo.py` | FdiAttack | 0.600 | 1.100 | 0.500 | 1.600 | learns: +0.600" in text
    assert "does not run: pip / went back" in text
    assert "1 of 2 programs learn. 0 of them" in text
    assert "- other, FdiAttack: wants less" in text


def test_every_program_is_there_once() -> None:
    assert len({program.name for program in PROGRAMS}) == len(PROGRAMS)
    for program in PROGRAMS:
        assert (learning.ROOT / "examples" / f"{program.file}.py").is_file()


def test_an_older_release_is_a_failure(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(learning, "newest", lambda name: "2.0")
    monkeypatch.setattr(learning, "versions", lambda python, names: dict.fromkeys(names, "1.0"))
    program = Program("plain_ppo", "a library", "here", ("library[more]",), note="it wants an older numpy")
    row = learn(program, tmp_path, None, tmp_path, keep=True)
    assert row["failed"] == "pip went back to 1.0; the newest release is 2.0 because it wants an older numpy"


def test_what_an_earlier_run_left_is_judged_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    kept: dict[str, Any] = {"before": paid(0.5), "after": paid(1.0)}
    monkeypatch.setattr(learning, "newest", lambda name: "1.0")
    monkeypatch.setattr(learning, "versions", lambda python, names: dict.fromkeys(names, "1.0+cpu"))
    monkeypatch.setattr(learning, "rivals", lambda *_: {"random": paid(0.4), "constant": paid(1.5)})
    (tmp_path / "learning").mkdir()
    (tmp_path / "learning" / "plain_ppo-FdiAttack.json").write_text(json.dumps(kept))
    row = learn(Program("plain_ppo", "a library", "here", ("library",)), tmp_path, None, tmp_path, keep=True)
    assert (row["version"], row["learns"]) == ("1.0", True)


def test_the_best_constant_is_at_least_level_with_random_play() -> None:
    found = rivals("FdiAttack", {}, episodes=20)
    assert {name: len(each) for name, each in found.items()} == {"random": 20, "constant": 20}
    assert np.mean(found["constant"]) >= np.mean(found["random"])
