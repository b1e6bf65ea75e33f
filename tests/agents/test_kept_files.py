"""Files: written whole or not at all; what is read back fits, or is refused with file, place and remedy."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from cps_agents.arena.venue import Venue
from cps_agents.cli import app
from cps_agents.commands.certify import plain_values, stored_episodes
from cps_agents.files import check_writable, draft_name, replacing, write_text
from cps_agents.league.exploitability import league_value
from cps_agents.league.self_play import _load
from cps_agents.learning.recipe import Recipe
from cps_agents.learning.run import TrainingJob
from cps_envs.core.documents import DamagedFileError
from cps_envs.fdi.config import A

VENUE = Venue("rogue", "easy", {"duration_s": 12.0})
RUN = TrainingJob(Recipe(name="tiny", problem="rogue", role="attacker"), 0, Path(), "cps-envs train")
ROW = {
    "task": "x4>4",
    "gains": [1.0, 3.0],
    "lp_mps": None,
    "value_mps": 2.0,
    "bound_mps": 2.5,
    "status": "proved",
    "wall_s": 1.0,
}
RESPONSE = {"oracle": "ppo", "seed": 0, "reference": "pd", "steps": 5, "cpu_s": 1.0, "validation": 1.0}
SIDE = {"found": [RESPONSE], "left_out": {"search": "no time"}}
MIX = {"policies": ["pd"], "probabilities": [1.0]}


def test_two_writers_of_one_file_never_mix(tmp_path: Path) -> None:
    """As two containers do on one drive, or two threads: their processes have one number."""
    path = tmp_path / "kept.json"
    with replacing(path) as first, first.open("w", encoding="utf-8") as file:
        file.write('{"who": "A", ')
        file.flush()
        write_text(path, '{"who": "B"}')
        assert path.read_text(encoding="utf-8") == '{"who": "B"}'
        file.write('"rows": []}')
    assert path.read_text(encoding="utf-8") == '{"who": "A", "rows": []}'
    assert [each.name for each in tmp_path.iterdir()] == ["kept.json"]


def test_a_draft_is_never_written_into(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = iter([b"one", b"one", b"two"])
    monkeypatch.setattr("cps_agents.files.os.urandom", lambda size: next(names))
    with replacing(tmp_path / "a.json") as first, replacing(tmp_path / "b.json") as second:
        assert first.stem.endswith(f"-{b'one'.hex()}")
        assert second.stem.endswith(f"-{b'two'.hex()}")


def test_drafts_of_the_dead_are_swept_and_others_stay(tmp_path: Path) -> None:
    drafts = tmp_path / ".drafts"
    drafts.mkdir()
    machine, *_ = draft_name().split("-")
    killed = subprocess.Popen([sys.executable, "-c", ""])
    killed.wait()
    for name in (
        f"{machine}-{killed.pid}-ab.json",
        f"{machine}-{os.getpid()}-cd.json",
        f"elsewhere-{killed.pid}-ef.json",
    ):
        (drafts / name).touch()
    with replacing(tmp_path / "a.json"):
        left = sorted(each.name.split("-")[2] for each in drafts.iterdir())
    assert len(left) == 3
    assert {"cd.json", "ef.json"} < set(left)


def test_what_cannot_be_written_is_said_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match=r"it cannot be written: Not a directory: .*file/new/a.json"):
        check_writable(tmp_path / "file" / "new" / "a.json")
    check_writable(tmp_path / "new" / "folder" / "a.json")
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


def test_a_folder_for_finished_games_is_named_if_none_can_be_kept(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    found = CliRunner().invoke(app, ["evaluate", "rogue", "--meetings", str(tmp_path / "file" / "x")])
    assert found.exit_code == 2
    assert "name a folder that can be written, with --meetings DIR" in " ".join(found.output.split())


def league() -> dict[str, Any]:
    equilibrium = {"value": 3.0, "low": 2.0, "high": None}
    config = plain_values(VENUE.config)
    return {"equilibrium": equilibrium, "config": config, "problem": "rogue", "metric": "return", "episodes": 3}


def iteration() -> dict[str, Any]:
    return {
        "responses": {"attacker": dict(SIDE), "defender": dict(SIDE)},
        "profile": {"attacker": dict(MIX), "defender": dict(MIX)},
    }


def read_run(path: Path) -> None:
    replace(RUN, folder=path.parent).read()


def read_evaluations(path: Path) -> None:
    path.rename(path.parent / "evaluations.jsonl")
    list(replace(RUN, folder=path.parent).evaluations())


KINDS: dict[str, tuple[str, Callable[[], Any], Callable[[Path], object]]] = {
    "episodes": (
        "episodes.json",
        lambda: {"config": plain_values(A), "episodes": {"0": dict(ROW)}},
        lambda path: stored_episodes(path, A),
    ),
    "league": ("rogue.json", league, lambda path: league_value(path, VENUE)),
    "iteration": ("result.json", iteration, lambda path: _load(path.parent, 0)),
    "run": ("run.json", lambda: {"recipe": {}, "seed": 0, "status": "running", "best_score": None}, read_run),
    "evaluations": ("evaluations.json", lambda: {"steps": 1, "validation": 2.0}, read_evaluations),
}
WRONG: list[tuple[str, tuple[Any, ...], Any]] = [  # kind, place, value
    ("episodes", ("episodes", "0", "bound_mps"), float("nan")),
    ("episodes", ("episodes", "0", "bound_mps"), 1.0),
    ("episodes", ("episodes", "0", "value_mps"), "2"),
    ("episodes", ("episodes", "0", "status"), 1),
    ("episodes", ("episodes", "0", "gains"), ["a"]),
    ("episodes", ("episodes", "0"), []),
    ("episodes", ("episodes",), [1]),
    ("league", ("equilibrium", "value"), None),
    ("league", ("equilibrium", "low"), "2"),
    ("league", ("equilibrium",), 3),
    ("league", ("config",), []),
    ("league", ("problem",), ["rogue"]),
    ("league", ("episodes",), 0),
    ("iteration", ("responses", "attacker", "found"), []),
    ("iteration", ("responses", "attacker", "found", 0, "seed"), "x"),
    ("iteration", ("responses", "attacker", "found", 0, "reference"), 1),
    ("iteration", ("responses", "attacker", "found", 0, "steps"), 1.5),
    ("iteration", ("responses", "attacker", "found", 0, "validation"), float("inf")),
    ("iteration", ("responses", "attacker", "left_out"), {"search": 1}),
    ("iteration", ("profile", "defender", "probabilities"), [0.5]),
    ("iteration", ("profile", "defender", "probabilities"), [-1, 2]),
    ("iteration", ("profile", "defender", "policies"), [3]),
    ("run", ("status",), "paused"),
    ("run", ("best_score",), "good"),
    ("run", ("recipe",), [1]),
    ("run", ("steps",), -1),
    ("evaluations", ("validation",), "x"),
]


def write(tmp_path: Path, kind: str, text: str) -> Path:
    path = tmp_path / KINDS[kind][0]
    path.write_text(text)
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_what_fits_is_read(kind: str, tmp_path: Path) -> None:
    _, content, read = KINDS[kind]
    read(write(tmp_path, kind, json.dumps(content())))


@pytest.mark.parametrize(("kind", "place", "value"), WRONG, ids=str)
def test_a_wrong_value_is_named_with_its_place(kind: str, place: tuple[Any, ...], value: Any, tmp_path: Path) -> None:
    _, content, read = KINDS[kind]
    document = content()
    target = document
    for step in place[:-1]:
        target = target[step]
    target[place[-1]] = value
    path = write(tmp_path, kind, json.dumps(document))
    with pytest.raises(DamagedFileError, match=rf"{path.stem}.* is no .* \(.*\)\. [A-Z].*\."):
        read(path)


@pytest.mark.parametrize("text", ["", "null", "[3", "{", '{"a":' * 100_000, "\x00"])
@pytest.mark.parametrize("kind", list(KINDS))
def test_other_files_are_refused_in_one_sentence(kind: str, text: str, tmp_path: Path) -> None:
    if kind == "evaluations" and not text:
        return  # no lines at all
    with pytest.raises(DamagedFileError, match=r" is no .* \(.*\)\. [A-Z].*\."):
        KINDS[kind][2](write(tmp_path, kind, text))


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "file.txt"
    target.write_text("old")

    def write_half() -> None:
        with replacing(target) as draft:
            draft.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_is_being_written_is_seen_by_nobody(tmp_path: Path) -> None:
    target = tmp_path / "card.json"
    with replacing(target) as draft:
        draft.write_text("{")
        assert draft.suffix == ".json"  # which writers of pictures go by
        assert list(tmp_path.glob("*.json")) == []
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "folder").write_text("a file where a folder is needed")
    target = tmp_path / "folder" / "file.txt"
    with pytest.raises(OSError, match=r"folder/file\.txt"), replacing(target) as draft:
        draft.write_text("never")
    full = tmp_path / "full.txt"
    with pytest.raises(OSError, match=r"cannot be written: No space left on device.*full\.txt"), replacing(full):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert not full.exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_device_or_a_pipe_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="it is a device or a pipe"), replacing(tmp_path / "pipe"):
        raise AssertionError("unreachable")
    assert list(tmp_path.iterdir()) == [tmp_path / "pipe"]


def test_errors_about_other_files_stay_as_they_are(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"other\.txt"), replacing(tmp_path / "file.txt"):
        (tmp_path / "other.txt").read_text()


def test_writers_in_one_folder_do_not_disturb_one_another(tmp_path: Path) -> None:
    def write(place: int) -> None:
        for _ in range(200):
            write_text(tmp_path / f"{place}.txt", "whole\n")

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, range(4)))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.txt", "1.txt", "2.txt", "3.txt"]
