"""Threads that step the environments of a batch side by side."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np

from cps_envs.core.types import BoolArray

WORTH_S = 300e-6  # work that takes longer in one thread is split: handing a block over costs about 20 us
MOST_RESTS = 256  # calls in one thread between two attempts at more on a machine that is busy
UNTIMED = 63  # calls after one that took less than a quarter of what is worth a thread: the clock would be felt


class Threads:
    """Runs a kernel on blocks of environments at once, each thread with the block that it is handed as a mask.

    The kernel releases the GIL. It reads and writes only the environments that are marked for it, so the result does
    not depend on the number of threads, nor on when they are used: only where they save time. What a game step of an
    environment takes is measured at each call, of short ones now and then. Where threads have lost, because others use
    the cores, one thread does the next calls: 1, 2, 4, ... of them. A copy or a pickle starts its own threads.
    """

    def __init__(self, num_threads: int, num_envs: int) -> None:
        edges = np.linspace(0, num_envs, min(num_threads, num_envs) + 1).astype(int).tolist()
        places = np.arange(num_envs)
        self.alone = len(edges) == 2  # one thread: whoever counts tenths of microseconds calls the kernel himself
        self.worth_s = WORTH_S  # 0: always split
        self._step_s, self._latest_s = 0.0, 0.0  # of a game step of an environment: the less of two calls; the last one
        self._untimed = 0  # short calls to come that nobody measures
        self._rests, self._resting = 1, 0  # calls in one thread after the next loss; such calls still to come
        self._blocks = [(a <= places) & (places < b) for a, b in pairwise(edges)]
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0  # the one that started the pool: threads do not survive a fork

    def run(self, call: Callable[[BoolArray], Any], envs: BoolArray, num_steps: int = 1) -> None:
        """Call `call(mask)` for the marked environments (B,), which it moves by `num_steps` game steps.

        It is called once, or where that would take longer than `worth_s` once for each block.
        """
        if self.alone:
            call(envs)
            return
        if self._untimed > 0:
            self._untimed -= 1
            call(envs)
            return
        steps = num_steps * int(np.count_nonzero(envs))
        alone_s = self._step_s * steps
        if alone_s < self.worth_s or self._resting > 0:
            self._resting = max(self._resting - 1, 0)
            self._timed(call, envs, steps)
            short = 0 < self._latest_s * num_steps * len(envs) < self.worth_s / 4
            self._untimed = UNTIMED if short else 0
            return
        start = perf_counter()
        self._split(call, envs, num_steps)
        lost = perf_counter() - start > alone_s > 0
        self._resting = self._rests if lost else 0
        self._rests = min(2 * self._rests, MOST_RESTS) if lost else 1

    def _split(self, call: Callable[[BoolArray], Any], envs: BoolArray, num_steps: int) -> None:
        if self._pool is None or self._process != os.getpid():
            self._pool, self._process = ThreadPoolExecutor(len(self._blocks) - 1), os.getpid()
        waiting = [self._pool.submit(call, envs & block) for block in self._blocks[1:]]
        mine = envs & self._blocks[0]
        self._timed(call, mine, num_steps * int(np.count_nonzero(mine)))
        for future in waiting:
            future.result()

    def _timed(self, call: Callable[[BoolArray], Any], envs: BoolArray, steps: int) -> None:
        """Call it, and learn what a step takes; the less of two calls counts, as one may compile or be interrupted."""
        start = perf_counter()
        call(envs)
        if steps > 0:
            latest_s = (perf_counter() - start) / steps
            self._step_s, self._latest_s = min(latest_s, self._latest_s), latest_s

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_pool": None}
