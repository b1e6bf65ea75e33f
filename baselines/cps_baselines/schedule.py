"""What a problem's benchmark consists of, as plain data; each problem declares its own in `<problem>/benchmark.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Entrant:
    """A policy that takes part."""

    name: str
    policy: str = ""  # reference, as `cps-envs play` takes it; the name itself if empty
    title: str = ""  # in the tables, where the name does not say enough
    metric: str = ""  # what this attacker's row shows, where it is not the setting's
    prepare: str = ""  # "module:function", called as function(config, quick) in advance; it returns Prepared

    @property
    def heading(self) -> str:
        """What the tables call it."""
        return self.title or self.name

    @property
    def reference(self) -> str:
        """The policy to look up."""
        return self.policy or self.name


@dataclass(frozen=True)
class Prepared:
    """What an entrant found out in advance: the policy that it plays with, and a line about it."""

    policy: str
    note: str


@dataclass(frozen=True)
class Table:
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
    attackers: tuple[Entrant, ...]
    defenders: tuple[Entrant, ...]
    preset: str = "paper"
    overrides: Mapping[str, Any] = field(default_factory=dict)
    episodes: int = 1
    more_episodes: Mapping[str, int] = field(default_factory=dict)  # of some attackers
    reference: str = ""  # a metric that the number is compared with
    # Of a cell: `value`, its quartiles `lower`, `median`, `upper`, its `share` of the reference, means of all metrics.
    form: str = "{value:.2f}"
    legend: str = ""  # how to read a cell
    table: Table | None = None  # that this setting shares with others, which have the same attackers

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
