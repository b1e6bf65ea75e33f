"""A part of a reliability run whose processes die, hang or fail."""

from __future__ import annotations

import os
import signal
import time

from tools.reliability.chunk import Chunk, Part, Result
from tools.reliability.journal import Journal

HANGS_S = 60.0


def chunks() -> list[Chunk]:
    return [Chunk(__name__, row, limit_s=12.0 if row == "hangs" else 60.0) for row in ("dies", "hangs", "fails")]


def run(chunk: Chunk, journal: Journal) -> Result:
    if chunk.row == "fails":
        raise RuntimeError("the machine is broken")
    for number in range(3):
        if journal.begin(number, "a trial") and number == 1 and chunk.row == "dies":
            os.kill(os.getpid(), signal.SIGSEGV)
    if chunk.row == "hangs" and journal.begin(3, "a trial"):
        time.sleep(HANGS_S)
    return {"counts": {"inputs": 3 - len(journal.skipped) if chunk.row == "dies" else 0}, "examples": {}}


PART = Part("toys", "Toys", "", {"inputs": "inputs"}, frozenset(), chunks, run)
