"""Files that are either whole or not there, and folders and files that one command at a time writes."""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from cps_agents.console import to_json
from cps_agents.errors import CommandError

DPI = 130  # of figures
DRAFTS = ".drafts"  # folder of files that are being written
ATTEMPTS = 100  # to make it


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to, with the suffix of `path`; it takes the place of `path` when all went well.

    It lies in a hidden folder, where nobody who lists the files beside `path` finds it half written. What a process has
    left there that was killed goes when the next file is written beside it.

    Raises:
        OSError: the file cannot be written; the message names `path`.
    """
    _check_kind(path)
    drafts = path.parent / DRAFTS
    try:
        draft = _begin(drafts, path.suffix)
        try:
            yield draft
            _flush(draft)
            os.replace(draft, path)
        finally:
            with suppress(OSError):
                draft.unlink(missing_ok=True)
                drafts.rmdir()  # if nobody else writes there
    except OSError as error:
        if error.filename is None or DRAFTS in Path(str(error.filename)).parts:
            raise OSError(error.errno, f"it cannot be written: {error.strerror}", str(path)) from error
        raise


def check_writable(path: Path) -> None:
    """Say at once, and not after long work, that a file cannot be written; nothing is left behind.

    Raises:
        OSError: it cannot be; the message names `path`.
    """
    _check_kind(path)
    there = next(parent for parent in path.absolute().parents if parent.exists())
    if not there.is_dir():
        raise OSError(errno.ENOTDIR, f"it cannot be written: {os.strerror(errno.ENOTDIR)}", str(path))
    if not os.access(there, os.W_OK | os.X_OK):
        raise OSError(errno.EACCES, f"it cannot be written: {os.strerror(errno.EACCES)}", str(path))


def _check_kind(path: Path) -> None:
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EINVAL, "it cannot be written: it is a device or a pipe", str(path))


def draft_name() -> str:
    """A name that nobody else has, and that tells whose draft it is, see `sweep`."""
    return f"{_machine()}-{os.getpid()}-{os.urandom(8).hex()}"


def sweep(drafts: Path) -> None:
    """Remove what processes of this machine have left in a folder of drafts that are no longer there."""
    found: list[Path] = []
    with suppress(OSError):  # there is no such folder, or no longer
        found = list(drafts.glob(f"{_machine()}-*-*")) if os.name == "posix" else []
    for draft in found:
        owner = draft.name.split("-")[1]
        if owner.isdigit() and not _is_alive(int(owner)):
            with suppress(OSError):
                shutil.rmtree(draft) if draft.is_dir() else draft.unlink()


def _machine() -> str:
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)  # sends nothing
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # somebody else's
        pass
    return True


def _begin(drafts: Path, suffix: str) -> Path:
    """Make an empty file that nobody else has, and its folder, which another process may be about to remove."""
    sweep(drafts)
    for attempts_left in reversed(range(ATTEMPTS)):
        draft = drafts / f"{draft_name()}{suffix}"
        try:
            drafts.mkdir(parents=True, exist_ok=True)
            draft.touch(exist_ok=False)
            return draft
        except (FileExistsError, FileNotFoundError):  # the folder was removed between two looks at it
            if not attempts_left:
                raise
    raise AssertionError("unreachable")


def _flush(path: Path) -> None:
    """Have the file's content on the disk before its name is there."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


def write_text(path: Path, text: str) -> None:
    """Write a text file at once."""
    with replacing(path) as draft:
        draft.write_text(text, encoding="utf-8", newline="\n")


def write_json(path: Path, value: Any) -> None:
    """Write a JSON file at once."""
    write_text(path, to_json(value) + "\n")


def write_figure(path: Path, figure: Any) -> None:
    """Write a matplotlib figure at once, in the format of the path's suffix."""
    with replacing(path) as draft:
        figure.savefig(draft, dpi=DPI)


@contextmanager
def alone_in(folder: Path, wait_s: float = 0.0) -> Iterator[None]:
    """While no other command writes into a folder, which is made if need be; another one's end is waited for so long.

    The system frees the lock of a process that has died, however it died; the empty file `.lock` stays.

    Raises:
        CommandError: another command is writing there.
        OSError: nothing can be written there.
    """
    with _held(folder / ".lock", f"into {folder}", wait_s):
        yield


@contextmanager
def alone_at(path: Path, wait_s: float = 0.0) -> Iterator[None]:
    """While no other command writes a file; see `alone_in`."""
    with _held(path.with_name(f".{path.name}.lock"), str(path), wait_s):
        yield


@contextmanager
def _held(lock: Path, what: str, wait_s: float = 0.0) -> Iterator[None]:
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = f"nothing can be written there: {error.strerror}; choose another folder"
        raise OSError(error.errno, reason, str(lock.parent)) from error
    from filelock import FileLock, Timeout  # brings sockets along

    held = FileLock(lock, timeout=wait_s)
    try:
        held.acquire()
    except Timeout:
        raise CommandError(f"another command is writing {what}: wait until it has ended, or choose another") from None
    try:
        yield
    finally:
        held.release()
