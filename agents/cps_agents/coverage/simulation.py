"""Repeating cases and counting how often their intervals hold the truth."""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cps_agents.coverage.case import Case, Coverage, Outcome
from cps_baselines.workers import Workers

Report = Callable[[int, str], None]  # pieces of work done, the last one
CHUNK = 100  # repetitions of a piece of work


@dataclass(frozen=True)
class Effort:
    """How much is simulated."""

    repetitions: int = 1000
    resamples: int = 600  # of each bootstrap; the 4,000 of evaluations hold the truth a little more often


@dataclass(frozen=True)
class _Piece:
    case: Case
    repetitions: range
    resamples: int


@dataclass(frozen=True)
class _Part:
    first: int
    outcomes: list[Outcome]
    cpu_s: float


def simulate(
    cases: Sequence[Case], effort: Effort, workers: int = 1, report: Report = lambda done, label: None
) -> list[Coverage]:
    """Every case; the same figures however many processes work."""
    pieces = [
        _Piece(case, range(first, min(first + CHUNK, effort.repetitions)), effort.resamples)
        for case in cases
        for first in range(0, effort.repetitions, CHUNK)
    ]
    found: dict[str, list[_Part]] = {case.title: [] for case in cases}
    with Workers(workers) as pool:
        for done, (piece, part) in enumerate(pool.run(_repeat, pieces), 1):
            found[piece.case.title].append(part)
            report(done, piece.case.title)
    return [_counted(case, found[case.title]) for case in cases]


def _repeat(piece: _Piece) -> _Part:
    started, key = time.process_time(), zlib.crc32(piece.case.title.encode())
    generators = (np.random.default_rng([key, number]) for number in piece.repetitions)
    outcomes = [piece.case.draw(generator, piece.resamples) for generator in generators]
    return _Part(piece.repetitions.start, outcomes, time.process_time() - started)


def _counted(case: Case, parts: Sequence[_Part]) -> Coverage:
    outcomes = [each for part in sorted(parts, key=lambda part: part.first) for each in part.outcomes]
    errors = np.array([found.mean - truth for found, truth in outcomes])
    ends = np.array([[found.low, found.high] for found, _ in outcomes], np.float64)
    truths = np.array([truth for _, truth in outcomes])
    above, below = int((ends[:, 0] > truths).sum()), int((ends[:, 1] < truths).sum())
    return Coverage(
        group=case.group,
        title=case.title,
        note=case.note,
        repetitions=len(outcomes),
        held=len(outcomes) - above - below,
        above=above,
        below=below,
        bias=float(errors.mean()),
        length=float((ends[:, 1] - ends[:, 0]).mean()),
        cpu_s=round(sum(part.cpu_s for part in parts), 2),
    )
