"""Threads that step the environments of a batch side by side."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from cps_envs.core.types import BoolArray


class Threads:
    """Runs a kernel on blocks of environments at once, each thread with the block that it is handed as a mask.

    The kernel releases the GIL. It reads and writes only the environments that are marked for it, so the result does
    not depend on the number of threads. A copy or a pickle starts its own threads.
    """

    def __init__(self, num_threads: int, num_envs: int) -> None:
        edges = np.linspace(0, num_envs, min(num_threads, num_envs) + 1).astype(int).tolist()
        places = np.arange(num_envs)
        self.alone = len(edges) == 2  # one thread: whoever counts tenths of microseconds calls the kernel himself
        self._blocks = [(a <= places) & (places < b) for a, b in pairwise(edges)]
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0  # the one that started the pool: threads do not survive a fork

    def run(self, call: Callable[[BoolArray], Any], envs: BoolArray) -> None:
        """Call `call(mask)` once for each block, with the marked environments (B,) of that block."""
        if self.alone:
            call(envs)
            return
        if self._pool is None or self._process != os.getpid():
            self._pool, self._process = ThreadPoolExecutor(len(self._blocks) - 1), os.getpid()
        waiting = [self._pool.submit(call, envs & block) for block in self._blocks[1:]]
        call(envs & self._blocks[0])
        for future in waiting:
            future.result()

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_pool": None}
