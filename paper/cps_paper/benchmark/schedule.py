"""What a problem's benchmark consists of, as plain data; each problem declares its own in `<problem>/benchmark.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cps_baselines.arena import Contestant, Venue


@dataclass(frozen=True)
class SharedTable:
    """A table whose columns are settings instead of defenders."""

    name: str  # short, for file names
    title: str
    axis: str  # what distinguishes the columns, such as "task"


@dataclass(frozen=True)
class Setting:
    """One configuration in which every attacker meets every defender."""

    name: str  # short, for file names
    title: str  # of its table, or of its columns in a table that it shares
    metric: str  # the number that the table shows
    venue: Venue
    attackers: tuple[Contestant, ...]
    defenders: tuple[Contestant, ...]
    episodes: int = 1
    more_episodes: Mapping[str, int] = field(default_factory=dict)  # of some attackers
    reference: str = ""  # a metric that the number is compared with
    # Of a cell: `value`, its quartiles `lower`, `median`, `upper`, its `share` of the reference, means of all metrics.
    form: str = "{value:.2f}"
    legend: str = ""  # how to read a cell
    table: SharedTable | None = None  # that this setting shares with others, which have the same attackers
    only_full: bool = False  # whether it is left to `--full`

    def episodes_of(self, attacker: str) -> int:
        """How many episodes an attacker plays against each defender, on seeds 0, 1, ..."""
        return self.more_episodes.get(attacker, self.episodes)


@dataclass(frozen=True)
class PaperCell:
    """What the paper prints for a meeting."""

    setting: str
    attacker: str
    defender: str
    value: float  # of the metric that the attacker's row shows
    crash: bool
    where: str


@dataclass(frozen=True)
class Benchmark:
    """Everything that is played for a problem."""

    problem: str
    settings: tuple[Setting, ...]
    paper: tuple[PaperCell, ...] = ()
    crash_metric: str = ""  # above 0 where there was a crash
    notes: tuple[str, ...] = ()
