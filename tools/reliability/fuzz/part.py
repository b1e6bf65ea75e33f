"""Hostile and mistaken inputs: each is accepted and works, or is refused with a sentence."""

from __future__ import annotations

import resource
from collections.abc import Callable, Mapping
from importlib import import_module

from tools.reliability.chunk import CODE, Chunk, Part, Result
from tools.reliability.journal import Journal

MEMORY = 12 * 2**30  # bytes of addresses that a process may use: more ends in a MemoryError
CHUNKS: Mapping[str, tuple[str, int]] = {  # row: what does it, and how many chunks
    "configurations": ("configurations:configurations", 16),
    "opponents by name": ("configurations:opponents", 16),
    "command lines": ("commands:commands", 12),
    "cards and weights": ("files:cards", 8),
    "results of finished pairs": ("files:cells", 2),
}
FUZZ = "tools/reliability/fuzz"
USED = (  # by everything but command lines: the environments, and where policies and results are read
    "cps_envs",
    "baselines/cps_baselines",
    "agents/cps_agents/zoo",
    "agents/cps_agents/arena",
)


def chunks() -> list[Chunk]:
    """Every row's first chunk, then every row's second one, and so on. A chunk's number is its seed."""
    found = [
        Chunk("fuzz", row, number, (*(CODE if place.startswith("commands:") else USED), FUZZ))
        for row, (place, count) in CHUNKS.items()
        for number in range(count)
    ]
    return sorted(found, key=lambda chunk: chunk.number)


def run(chunk: Chunk, journal: Journal) -> Result:
    """Try the inputs of a chunk."""
    from tools.reliability.fuzz.judging import Tally

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    module, _, name = CHUNKS[chunk.row][0].partition(":")
    tally = Tally(chunk, journal)
    trial: Callable[[Chunk, Tally], None] = getattr(import_module(f"tools.reliability.fuzz.{module}"), name)
    trial(chunk, tally)
    return tally.result()


PART = Part(
    name="fuzz",
    title="Hostile inputs",
    about=(
        "Random inputs, many of them wrong on purpose: configurations, opponents, command lines, and files that "
        "somebody has edited. (The tests of the suite draw actions of every kind.) An input is accepted when "
        "everything that comes back is finite and inside its space. It is refused when one of our own errors or one "
        "of Gymnasium's says so. An accident is another error from further inside, such as a `TypeError` of a library. "
        "A crash ends the process; a hang lasts half an hour. Nonsense is an accepted input with a wrong "
        "outcome. A command that still "
        "works after 1.5 CPU seconds, or anything else after 2, counts as accepted."
    ),
    columns={
        "inputs": "inputs",
        "accepted": "accepted",
        "refused": "refused clearly",
        "accidental": "accident",
        "crash": "crash",
        "hang": "hang",
        "nonsense": "nonsense",
    },
    forbidden=frozenset({"accidental", "crash", "hang", "nonsense"}),
    chunks=chunks,
    run=run,
)
