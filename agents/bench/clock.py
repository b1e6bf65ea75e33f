"""Counting calls per CPU second of this process."""

from __future__ import annotations

import time
from collections.abc import Callable

ROUNDS = 3  # the best one counts: the others were disturbed


def calls_per_s(call: Callable[[], object], seconds: float) -> float:
    """Calls per CPU second: the best of a few rounds that together take about `seconds`. The first call warms up."""
    call()
    return max(_one_round(call, seconds / ROUNDS) for _ in range(ROUNDS))


def _one_round(call: Callable[[], object], seconds: float) -> float:
    calls, batch = 0, 1
    start = time.process_time()
    while True:
        for _ in range(batch):
            call()
        calls += batch
        spent = time.process_time() - start
        if spent >= seconds:
            return calls / spent
        batch = max(1, min(2 * batch, int(calls / max(spent, 1e-9) * (seconds - spent)) + 1))
