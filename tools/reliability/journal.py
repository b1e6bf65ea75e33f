"""What a process is about to try, written down first, so that its death tells what killed it."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

MOST = 2000  # bytes


class Journal:
    """One line in a file, overwritten before each trial; `skipped` trials killed an earlier process."""

    def __init__(self, path: Path | None = None, skipped: Collection[int] = ()) -> None:
        self.skipped = frozenset(skipped)
        self._file = None if path is None else os.open(path, os.O_WRONLY | os.O_CREAT)

    def begin(self, number: int, what: str) -> bool:
        """Note that a trial begins; False if it has to be left out."""
        if number in self.skipped:
            return False
        if self._file is not None:
            os.pwrite(self._file, f"{number} {what}".encode("utf-8", "backslashreplace")[:MOST].ljust(MOST), 0)
        return True


def read_journal(path: Path) -> tuple[int, str]:
    """The trial that was begun last; -1 if none was."""
    try:
        number, _, what = path.read_text(encoding="utf-8", errors="replace").rstrip().partition(" ")
        return int(number), what
    except (OSError, ValueError):
        return -1, ""
