"""Ctrl-C and the signals that ask a process to end, as one exception that lets work be kept."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

FIRST_SIGNAL_CODE = 128  # of the exit codes that shells give to processes ended by a signal
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
COMPILERS = ("llvmlite.", "numba.core.codegen")  # modules that are called from C, where an exception is lost
LATER_S = 0.05


class Ended(KeyboardInterrupt):
    """The process was asked to end, by Ctrl-C or another signal."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def exit_code(error: KeyboardInterrupt) -> int:
    """The usual exit code of a process that a signal has ended: 130 for Ctrl-C, 143 for SIGTERM."""
    return FIRST_SIGNAL_CODE + (error.number if isinstance(error, Ended) else int(signal.SIGINT))


def end(number: int, frame: FrameType | None) -> None:
    """Handle a signal by raising `Ended`, but only when a kernel that is being compiled is done.

    Signals other than Ctrl-C are heard once: what is being kept then is not disturbed by a second one.
    """
    if _compiles(frame):
        threading.Timer(LATER_S, signal.raise_signal, [number]).start()
        return
    if number != signal.SIGINT:
        signal.signal(number, signal.SIG_IGN)
    raise Ended(number)


def _compiles(frame: FrameType | None) -> bool:
    while frame is not None and not str(frame.f_globals.get("__name__")).startswith(COMPILERS):
        frame = frame.f_back
    return frame is not None


@contextmanager
def ending() -> Iterator[None]:
    """While signals that ask to end raise `Ended` in the main thread.

    A signal that is ignored, as `nohup` and background jobs of a shell ignore some, stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in ENDING}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
