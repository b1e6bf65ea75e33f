"""Killing a process at a chosen write: a file of ours takes its name by `os.replace`, and nothing else counts."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

MOMENTS = ("draft", "before", "after")  # with half a draft written, before and after the draft takes its name


def counting(folder: Path, counter: Path) -> Callable[[], None]:
    """For a process that is to tell in a file how often it writes below a folder."""
    return lambda: _intercept(folder, _Counter(counter))


def killing(folder: Path, number: int, moment: str) -> Callable[[], None]:
    """For a process that is to die at its write of this number, from 0, below a folder."""
    return lambda: _intercept(folder, _Killer(number, moment))


class _Counter:
    def __init__(self, counter: Path) -> None:
        self._counter, self._count = counter, 0

    def __call__(self, replace: Callable[..., None], draft: Any, path: Any) -> None:
        self._count += 1
        self._counter.write_text(str(self._count), encoding="utf-8")
        replace(draft, path)


class _Killer:
    def __init__(self, number: int, moment: str) -> None:
        self._left, self._moment = number, moment

    def __call__(self, replace: Callable[..., None], draft: Any, path: Any) -> None:
        if self._left == 0 and self._moment == "draft":
            os.truncate(draft, os.path.getsize(draft) // 2)
        if self._left == 0 and self._moment != "after":
            os.kill(os.getpid(), signal.SIGKILL)
        replace(draft, path)
        if self._left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        self._left -= 1


def _intercept(folder: Path, write: Callable[[Callable[..., None], Any, Any], None]) -> None:
    """Let `write` do what `os.replace` does, for files below a folder."""
    replace = os.replace

    def replacing(draft: Any, path: Any, **kwargs: Any) -> None:
        if not kwargs and Path(os.fspath(path)).is_relative_to(folder):
            write(replace, draft, path)
        else:
            replace(draft, path, **kwargs)

    os.replace = replacing  # type: ignore[assignment]
