"""What lies in a folder after a fault: whole files, finished work, and the same as without a fault."""

from __future__ import annotations

import csv
import json
import re
import zipfile
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.numpy import load_file

TIMES = re.compile(r".*(cpu_s|seconds|_per_s|wall|started|ended|resum|reused|command|date|time|digest).*")
PLACES = ("meetings", "matches")  # folders of finished work, one file each
UNREADABLE = (OSError, ValueError, SafetensorError, zipfile.BadZipFile)


def files_of(folder: Path) -> dict[str, Path]:
    """The files below a folder that anybody reads, by their place in it."""
    return {
        path.relative_to(folder).as_posix(): path
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    }


def damaged(folder: Path) -> list[str]:
    """Files that are not whole."""
    found = []
    for name, path in files_of(folder).items():
        try:
            _read(path)
        except UNREADABLE:
            found.append(name)
    return found


def _read(path: Path) -> None:
    if path.suffix == ".json":
        json.loads(path.read_text(encoding="utf-8"))
    elif path.suffix == ".jsonl":
        for line in path.read_text(encoding="utf-8").splitlines():
            json.loads(line)
    elif path.suffix == ".safetensors":
        load_file(path)
    elif path.suffix == ".zip":
        with zipfile.ZipFile(path) as archive:
            if archive.testzip() is not None:
                raise ValueError("damaged")


def finished(folder: Path) -> dict[str, tuple[int, bytes]]:
    """Finished work: when each file was written, and what it holds."""
    return {
        name: (path.stat().st_mtime_ns, path.read_bytes())
        for name, path in files_of(folder).items()
        if path.suffix == ".json" and set(PLACES) & set(path.parts)
    }


def lost(before: dict[str, tuple[int, bytes]], folder: Path) -> list[str]:
    """Finished work that was done again, or is gone."""
    after = finished(folder)
    return [name for name, kept in before.items() if after.get(name) != kept]


def differing(one: Path, other: Path, *, names_only: bool) -> list[str]:
    """Files that only one folder has, or whose content differs, times aside; logs of TensorBoard do not count.

    With `names_only` finished meetings do not count either: they are named by what a policy has learned.
    """
    left, right = (
        {
            name: path
            for name, path in files_of(each).items()
            if "events.out" not in name and not (names_only and set(PLACES) & set(path.parts))
        }
        for each in (one, other)
    )
    names = sorted(set(left) ^ set(right))
    if not names_only:
        names += [name for name in sorted(set(left) & set(right)) if not _same(left[name], right[name])]
    return names


def _same(one: Path, other: Path) -> bool:
    if one.suffix == ".json":
        left, right = (json.loads(path.read_text(encoding="utf-8")) for path in (one, other))
        return bool(_timeless(left) == _timeless(right))
    if one.suffix == ".csv":
        return _rows(one) == _rows(other)
    return one.suffix in (".md", ".png", ".svg") or one.read_bytes() == other.read_bytes()  # pages tell the time


def _rows(path: Path) -> list[Any]:
    with path.open(newline="", encoding="utf-8") as file:
        return [_timeless(row) for row in csv.DictReader(file)]


def _timeless(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _timeless(each) for name, each in value.items() if not TIMES.match(str(name))}
    return [_timeless(each) for each in value] if isinstance(value, list) else value
