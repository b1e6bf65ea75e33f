"""What a problem's benchmark consists of, as plain data; each problem declares its own in `<problem>/benchmark.py`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from cps_agents.arena.table import Table
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import ConfigurationError


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
    """Everything that is played for a problem.

    Raises:
        ConfigurationError: two of its tables, or of a table's contestants of a role, have one name.
    """

    problem: str
    tables: tuple[Table, ...]
    paper: tuple[PaperCell, ...] = ()
    crash_metric: str = ""  # above 0 where there was a crash
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_names(self.tables, f"tables of the benchmark of {self.problem}")
        for table in self.tables:
            _check_names(table.attackers, f"attackers of table {table.name!r}")
            _check_names(table.defenders, f"defenders of table {table.name!r}")


def _check_names(named: Sequence[Table | Contestant], what: str) -> None:
    for name, count in Counter(each.name for each in named).items():
        if count > 1:
            raise ConfigurationError(f"{count} {what} are called {name!r}: give each a name of its own")
