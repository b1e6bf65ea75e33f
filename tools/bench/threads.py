"""What threads gain. The one table by the clock on the wall: a CPU second of two threads takes half a second."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from time import perf_counter

from cps_agents.bench.interfaces import vector
from cps_agents.bench.row import Measurement, Values, Yardsticks, calls_per_s
from cps_agents.machine import available_cores
from cps_envs.core.game.problem import Problem

PART = "threads"
NUM_ENVS = (64, 1024)
TURNS = 5  # a slow moment of the machine then meets both


def items(problems: list[Problem]) -> Iterator[Measurement]:
    """The attacker's vector form of each problem under the preset `paper`, against the opponent `none`."""
    for problem in problems:
        for envs in NUM_ENVS:
            yield Measurement(
                PART, f"{problem.name} vector {envs}", partial(_measure, problem.env_id("attacker"), envs)
            )


def _measure(env_id: str, envs: int, seconds: float, yardsticks: Yardsticks) -> Values:
    """Steps per second with one thread, and with as many as there are cores, which take turns."""
    count = available_cores()
    calls = [vector(env_id, envs, neutral=True, num_threads=threads) for threads in (1, count)]
    turns = [[envs * calls_per_s(call, seconds / TURNS, perf_counter) for call in calls] for _ in range(TURNS)]
    alone, together = (max(rates) for rates in zip(*turns, strict=True))
    return {"threads": count, "alone_per_s": alone, "together_per_s": together, "speed_up": together / alone}
