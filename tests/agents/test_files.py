"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from cps_agents.files import replacing, write_text


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
