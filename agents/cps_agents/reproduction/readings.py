"""The readings of the dissertation that are offered: each chapter, once for each way to settle what it leaves open."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import ClassVar

from cps_agents.arena.meeting import Result
from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_agents.reproduction.chapter import Reproduction
from cps_agents.reproduction.rendering import render
from cps_baselines.reproduction.evidence import Report
from cps_envs.core.documents import Entry
from cps_envs.core.errors import near
from cps_envs.disbanding.config import INTERPRETATIONS

SETS = ("A", "B")  # of chapter 3
CONTROLLERS = ("clip", "qp")  # of chapter 4
PAGE_WIDTH = 120  # columns of a file with tables


@dataclass(frozen=True)
class Reading:
    """A chapter under one reading, and how much of it is computed."""

    kind: ClassVar[str] = "reading"
    name: str  # "ch2-S0", also of its files
    chapter: str  # "2", or section "2.5"
    problem: str
    quick: bool = False
    recheck: bool = False

    @property
    def label(self) -> str:
        """For progress and file names."""
        return self.name

    def run(self, jobs: int = 1, report: Report = lambda share, label: None) -> Result:
        """Compute it in so many processes: `document` (plain data), `text` (tables), `tallies`, `passed`, `wall_s`."""
        from rich.console import Console

        started = time.monotonic()
        found = _COMPUTE[self.chapter](self, jobs, report)
        page = io.StringIO()
        render(Console(file=page, width=PAGE_WIDTH, highlight=False), found)
        return {
            "document": json.loads(to_json(found.document())),
            "text": page.getvalue(),
            "tallies": [asdict(each) for each in found.tallies()],
            "passed": bool(found.passed),
            "wall_s": round(time.monotonic() - started, 1),
        }

    def check(self, result: Entry) -> None:
        """A document with its tables and tallies."""
        result["document"].entries()
        result["text"].text()
        for tally in result["tallies"].rows():
            tally.entries()
        result["wall_s"].number(0)

    @property
    def choice(self) -> str:
        """What is chosen, such as "S0"; empty where there is no choice."""
        return self.name.partition("-")[2]


def readings(*, quick: bool, recheck: bool) -> list[Reading]:
    """All of them, in the order of the dissertation."""
    found = [
        *((f"ch2-{name}", "2", "disbanding") for name in INTERPRETATIONS),
        ("testbed", "2.5", "disbanding"),
        *((f"ch3-{name}", "3", "fdi") for name in SETS),
        *((f"ch4-{name}", "4", "hvac") for name in CONTROLLERS),
        ("ch5", "5", "rogue"),
    ]
    return [Reading(*names, quick, recheck) for names in found]


def chosen(every: Sequence[Reading], names: Sequence[str]) -> list[Reading]:
    """Those with these names; all of them if none is named.

    Raises:
        CommandError: there is no such reading.
    """
    known = [reading.name for reading in every]
    for name in names:
        if name not in known:
            raise CommandError(f"there is no reading {name!r}. {near(name, known)} Known: {', '.join(known)}.")
    return [reading for reading in every if not names or reading.name in names]


def _chapter_2(reading: Reading, jobs: int, report: Report) -> Reproduction:
    from cps_baselines.disbanding.reproduction.chapter import reproduce_chapter
    from cps_baselines.disbanding.reproduction.selection import chosen

    parts, quick = chosen([], quick=reading.quick), reading.quick
    return reproduce_chapter(parts, reading.choice, jobs=jobs, quick=quick, recheck=reading.recheck, report=report)


def _section_2_5(reading: Reading, jobs: int, report: Report) -> Reproduction:
    from cps_baselines.testbed.cases import QUICK_SEEDS, SEEDS
    from cps_baselines.testbed.chapter import reproduce_section

    seeds = QUICK_SEEDS if reading.quick else SEEDS
    return reproduce_section(seeds, jobs=jobs, quick=reading.quick, report=report)


def _chapter_3(reading: Reading, jobs: int, report: Report) -> Reproduction:
    from cps_baselines.fdi.reproduction.chapter import reproduce_chapter
    from cps_baselines.fdi.reproduction.selection import chosen
    from cps_baselines.fdi.reproduction.settings import Settings

    parts, quick = chosen([], quick=reading.quick), reading.quick
    return reproduce_chapter(parts, Settings(reading.choice), jobs=jobs, quick=quick, report=report)


def _chapter_4(reading: Reading, jobs: int, report: Report) -> Reproduction:
    from cps_baselines.hvac.reproduction.chapter import reproduce_chapter
    from cps_baselines.hvac.reproduction.controllers import controller_named
    from cps_baselines.hvac.reproduction.selection import chosen

    parts, quick, controller = chosen([], quick=reading.quick), reading.quick, controller_named(reading.choice)
    return reproduce_chapter(
        parts, jobs=jobs, quick=quick, recheck=reading.recheck, controller=controller, report=report
    )


def _chapter_5(reading: Reading, jobs: int, report: Report) -> Reproduction:
    from cps_baselines.rogue.reproduction.chapter import reproduce_chapter
    from cps_baselines.rogue.reproduction.parts import chosen

    parts, quick = chosen([], quick=reading.quick), reading.quick
    return reproduce_chapter(parts, jobs=jobs, quick=quick, recheck=reading.recheck, report=report)


_COMPUTE: dict[str, Callable[[Reading, int, Report], Reproduction]] = {
    "2": _chapter_2,
    "2.5": _section_2_5,
    "3": _chapter_3,
    "4": _chapter_4,
    "5": _chapter_5,
}
