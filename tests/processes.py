"""Processes that tests start: waiting for what they do, and for their end."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path


def wait_until(there: Callable[[], object], seconds: float = 60.0) -> bool:
    """Whether something is there soon."""
    deadline = time.monotonic() + seconds
    while not (found := there()) and time.monotonic() < deadline:
        time.sleep(0.05)
    return bool(found)


def is_gone(group: int) -> bool:
    """Whether all processes of a group have ended."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def waited(item: tuple[bool, Path]) -> bool:
    """Work for another process: wait for a file, or for nothing; whether it is there in the end."""
    waits, path = item
    return not waits or wait_until(path.exists)
