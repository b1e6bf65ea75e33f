"""Killing a process at a chosen write: a file of ours takes its name by `os.replace`, and nothing else counts."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

MOMENTS = ("draft", "before", "after")  # with half a draft written, before and after the draft takes its name


def counting(folder: Path, counter: Path) -> Callable[[], None]:
    """For a process that is to tell in a file how often it writes below a folder."""
    return lambda: _intercept(folder, _Counter(counter))


def killing(folder: Path, number: int, moment: str, by: int) -> Callable[[], None]:
    """For a process that is to get a signal at its write of this number, from 0, below a folder."""
    return lambda: _intercept(folder, _Killer(number, moment, by))


class _Counter:
    def __init__(self, counter: Path) -> None:
        self._counter, self._count = counter, 0

    def __call__(self, replace: Callable[..., None], draft: Any, path: Any) -> None:
        self._count += 1
        self._counter.write_text(str(self._count), encoding="utf-8")
        replace(draft, path)


class _Killer:
    def __init__(self, number: int, moment: str, by: int) -> None:
        self._left, self._moment, self._by = number, moment, by

    def __call__(self, replace: Callable[..., None], draft: Any, path: Any) -> None:
        here, self._left = self._left == 0, self._left - 1
        if here and self._moment == "draft" and os.path.isfile(draft):
            os.truncate(draft, os.path.getsize(draft) // 2)
        if here and self._moment != "after":
            os.kill(os.getpid(), self._by)
        replace(draft, path)
        if here:
            os.kill(os.getpid(), self._by)


def _intercept(folder: Path, write: Callable[[Callable[..., None], Any, Any], None]) -> None:
    """Let `write` do what `os.replace` does, for files below a folder."""
    replace = os.replace

    def replacing(draft: Any, path: Any, **kwargs: Any) -> None:
        if not kwargs and Path(os.fspath(path)).is_relative_to(folder):
            write(replace, draft, path)
        else:
            replace(draft, path, **kwargs)

    os.replace = replacing  # type: ignore[assignment]
