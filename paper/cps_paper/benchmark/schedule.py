"""What a problem's benchmark consists of, as plain data; each problem declares its own in `<problem>/benchmark.py`."""

from __future__ import annotations

from dataclasses import dataclass

from cps_agents.arena.table import Table


@dataclass(frozen=True)
class PaperCell:
    """What the paper prints for a meeting."""

    table: str
    attacker: str
    defender: str
    value: float  # of the metric that the attacker's row shows
    crash: bool
    where: str


@dataclass(frozen=True)
class Benchmark:
    """Everything that is played for a problem."""

    problem: str
    tables: tuple[Table, ...]
    paper: tuple[PaperCell, ...] = ()
    crash_metric: str = ""  # above 0 where there was a crash
    notes: tuple[str, ...] = ()
