"""What a process is about to try, written down first, so that its death tells what killed it."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from threading import Lock

MOST = 2000  # bytes


class Journal:
    """One line in a file, overwritten before each trial; `skipped` trials killed an earlier process."""

    def __init__(self, path: Path | None = None, skipped: Collection[int] = ()) -> None:
        self.skipped = frozenset(skipped)
        self._file = None if path is None else os.open(path, os.O_WRONLY | os.O_CREAT)
        self._line, self._longest = "-1 no trial yet", 0
        self._lock = Lock()  # another thread notes waiting

    def begin(self, number: int, what: str) -> bool:
        """Note that a trial begins; False if it has to be left out."""
        if number in self.skipped:
            return False
        with self._lock:
            self._line = f"{number} {what}"
            self._write(self._line)
        return True

    def wait(self, seconds: float) -> None:
        """Note how long the process has waited for a processor: on a busy machine that is no silence."""
        with self._lock:
            self._write(f"{self._line} (it has waited {seconds:.0f} s for a processor)")

    def _write(self, text: str) -> None:
        if self._file is not None:
            line = text.encode("utf-8", "backslashreplace")[:MOST]
            self._longest = max(self._longest, len(line))
            os.pwrite(self._file, line.ljust(self._longest), 0)


def read_journal(path: Path) -> tuple[int, str]:
    """The trial that was begun last; -1 if none was."""
    try:
        number, _, what = path.read_text(encoding="utf-8", errors="replace").rstrip().partition(" ")
        return int(number), what
    except (OSError, ValueError):
        return -1, ""
