"""What git keeps is small: no recording, no result of a run, no weights but those that ship."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MOST_BYTES = 1_500_000
LARGER: frozenset[str] = frozenset()  # pictures that may be larger, by their path from the root


def test_no_tracked_file_is_large() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("needs the repository of git, not only its files")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = [ROOT / name for name in listed.split("\0") if name and name not in LARGER]
    large = {file.relative_to(ROOT).as_posix(): size for file in files if (size := _size(file)) > MOST_BYTES}
    assert not large, "keep it elsewhere, or name the picture in LARGER"


def _size(file: Path) -> int:
    return file.stat().st_size if file.is_file() else 0  # a deletion that is not committed yet
