"""What the command line tells its user instead of a traceback."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager


class CommandError(Exception):
    """Something that the user can put right; the message says what is wrong and what to do."""


def explain(error: Exception) -> str | None:
    """The message for an error that the user can put right, or None for one that is the program's own fault."""
    from cps_envs.core.errors import MissingExtraError, PolicyError, UnknownNameError

    if isinstance(error, MemoryError) or isinstance(error.__cause__, MemoryError):
        return "there is not enough memory: play fewer episodes or processes (--jobs), or raise the limit (ulimit -v)"
    if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
        return f"{error}: raise the limit of open files, for example by `ulimit -n 1024`, or use fewer --jobs"
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return f"{error}: make room there, or name another folder; what was finished before is kept"
    if isinstance(error, (CommandError, ValueError, UnknownNameError, MissingExtraError, OSError)):
        where = " (--debug shows where)" if isinstance(error, PolicyError) else ""
        return (str(error) or repr(error)) + where
    return None


@contextmanager
def built_by_user() -> Iterator[None]:
    """While things that the user named are put together, a wrong type is the user's mistake, too."""
    try:
        yield
    except TypeError as error:
        raise CommandError(str(error)) from error
