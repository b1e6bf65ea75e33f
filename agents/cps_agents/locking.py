"""Folders and files that one command at a time writes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from cps_agents.errors import CommandError


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """While no other command writes into a folder, which is made if need be.

    The system frees the lock of a process that has died, however it died; the empty file `.lock` stays.

    Raises:
        CommandError: another command is writing there.
        OSError: nothing can be written there.
    """
    with _held(folder / ".lock", f"into {folder}"):
        yield


@contextmanager
def alone_at(path: Path, wait_s: float = 0.0) -> Iterator[None]:
    """While no other command writes a file; see `alone_in`. Another one's end is waited for so many seconds."""
    with _held(path.with_name(f".{path.name}.lock"), str(path), wait_s):
        yield


@contextmanager
def _held(lock: Path, what: str, wait_s: float = 0.0) -> Iterator[None]:
    lock.parent.mkdir(parents=True, exist_ok=True)
    held = FileLock(lock, timeout=wait_s)
    try:
        held.acquire()
    except Timeout:
        raise CommandError(f"another command is writing {what}: wait until it has ended, or choose another") from None
    try:
        yield
    finally:
        held.release()
