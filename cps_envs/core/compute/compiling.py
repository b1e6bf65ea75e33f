"""What a process says on stderr while it compiles kernels: once that it does, then every few seconds which one.

A first use takes a minute otherwise silent. `CPS_ENVS_QUIET=1` hides these lines.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from typing import Any

from numba.core import event

QUIET = "CPS_ENVS_QUIET"
NOTICE = (
    "cps_envs: compiling kernels that this machine does not have yet: up to a minute for a problem. "
    f"`cps-envs warm` does it ahead; {QUIET}=1 hides this line."
)
EVERY_S = 6.0  # between two lines
COLUMNS = 79  # of a line: one less than a narrow terminal has
CLEAR = "\r\x1b[2K"  # a terminal's line, on which a progress bar may stand

declared: list[str] = []  # the kernels of the modules that this process has imported
loaded: list[str] = []  # those found compiled
compiled: list[str] = []  # those that it had to compile
told: set[str] = set()  # what it has said once


def tell(line: str) -> None:
    """Write a line to stderr, once in this process."""
    if line not in told:
        _write(line)
    told.add(line)


def announce(kernel: str) -> None:
    """Count a kernel that is about to be compiled, and say so at the first one."""
    tell(NOTICE)
    compiled.append(kernel)
    _watch.begin()


def _write(line: str) -> None:
    if os.environ.get(QUIET, "0") in ("", "0"):
        print(f"{CLEAR if sys.stderr.isatty() else ''}{line}", file=sys.stderr, flush=True)


class Watch(event.Listener):
    """Says every few seconds which kernel numba compiles; a kernel is compiled inside another one that calls it."""

    def __init__(self) -> None:
        self._depth, self._started, self._last_line = 0, 0.0, 0.0
        self._thread: threading.Thread | None = None

    def begin(self) -> None:
        """Watch from the first kernel on, while there is something to compile."""
        if self._thread is None:
            event.register("numba:compile", self)  # type: ignore[no-untyped-call]
            self._started = self._last_line = time.monotonic()
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._speak, daemon=True)
            self._thread.start()

    def on_start(self, event: Any) -> None:
        """Numba begins to compile."""
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """It has ended, well or not."""
        self._depth -= 1

    def _speak(self) -> None:
        while True:
            time.sleep(EVERY_S / 6)
            now = time.monotonic()
            if self._depth > 0 and now - self._last_line >= EVERY_S:
                self._last_line = now
                _write(line_of(compiled[-1], now - self._started))


def line_of(kernel: str, seconds: float) -> str:
    """A line about the kernel that is compiled now; kernels that nobody needs are among the most there may be."""
    most = max(len(declared) - len(loaded), len(compiled))
    return f"cps_envs: {seconds:3.0f} s, kernel {len(compiled)} of at most {most}: {kernel}"[:COLUMNS]


_watch = Watch()
