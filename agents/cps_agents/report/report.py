"""A report: leagues with episodes to watch, learning curves and the paper beside ours, in one folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cps_agents.arena.play import Report as Told
from cps_agents.arena.play import silent
from cps_agents.machine import describe
from cps_agents.report.board import Board, document
from cps_agents.report.page import write_episode, write_page
from cps_agents.report.replay import Take, record
from cps_baselines.workers import Workers

MOST_BYTES, LEAST_BYTES = 9_000_000, 60_000  # of all episodes, and of one that is long
PAPER = ("The paper beside ours", "What the dissertation prints, beside what this code computes.")
TITLE = "Attack and defence of cyber-physical systems"


@dataclass(frozen=True)
class Report:
    """What a page shows."""

    boards: Sequence[Board] = ()
    replays: int = 1  # episodes of each pair that can be watched
    curves: Sequence[dict[str, Any]] = ()
    sheets: Sequence[dict[str, Any]] = ()
    about_sheets: tuple[str, str] = PAPER  # heading and first sentence
    title: str = TITLE
    facts: Sequence[str] = field(default_factory=tuple)


def write_report(report: Report, folder: Path, workers: int = 1, told: Told = silent) -> Path:
    """Record the episodes and write the page; returns its path.

    The page comes first, so that a folder that cannot be written is told before anything is played.

    Raises:
        CommandError: the folder cannot be written.
    """
    takes = [board.takes(report.replays) for board in report.boards]
    content = {
        "title": report.title,
        "facts": [f"cps-envs {describe()['versions']['cps-envs']}", *report.facts],
        "boards": [document(board, chosen) for board, chosen in zip(report.boards, takes, strict=True)],
        "curves": list(report.curves),
        "sheets": list(report.sheets),
        "about_sheets": report.about_sheets,
        "foot": "Written by cps-envs. This page loads nothing from the network.",
    }
    page = write_page(folder, content)
    every = [take for chosen in takes for group in chosen.values() for take in group]
    room = MOST_BYTES // max(len(every), 1)
    _record([replace(take, most_bytes=max(room, LEAST_BYTES)) for take in every], folder, workers, told)
    return page


def _record(takes: Sequence[Take], folder: Path, workers: int, told: Told) -> None:
    with Workers(min(workers, max(len(takes), 1))) as pool:
        for done, (take, episode) in enumerate(pool.run(record, takes), start=1):
            write_episode(folder, take.key, episode)
            told(done, len(takes), take.label)
