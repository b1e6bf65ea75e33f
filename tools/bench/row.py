"""What the bench measures and what comes out, by the CPU time of this process: so others count as little as can be."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

Values: TypeAlias = Mapping[str, float]


@dataclass(frozen=True)
class Yardsticks:
    """What everything is compared with, measured in the same process shortly before."""

    cartpole_us: float  # CPU time of a step of a single CartPole
    updates_per_s: float  # of the simplest vehicle, see `tools.bench.interfaces`
    divisions_per_s: float  # of float64 in a compiled loop


@dataclass(frozen=True)
class Row:
    """Something measured; part and name identify it."""

    part: str
    name: str
    values: Values
    note: str = ""


@dataclass(frozen=True)
class Measurement:
    """Something to be measured, with about so many CPU seconds."""

    part: str
    name: str
    measure: Callable[[float, Yardsticks], Values]
    note: str = ""


ROUNDS = 3  # the best one counts: the others were disturbed
Call = Callable[[], object]


def calls_per_s(call: Call, seconds: float) -> float:
    """Calls per CPU second: the best of a few rounds that together take about `seconds`. The first call warms up."""
    call()
    return max(_one_round(call, seconds / ROUNDS) for _ in range(ROUNDS))


def _one_round(call: Call, seconds: float) -> float:
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


def microseconds(start: Call, call: Call, count: int) -> float:
    """CPU time of a call, the mean of the `count` that follow `start`, which is not counted."""
    start()
    begin = time.process_time_ns()
    for _ in range(count):
        call()
    return (time.process_time_ns() - begin) / count / 1e3
