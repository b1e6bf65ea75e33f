"""An examination as plain data; each problem declares its blocks in `agents/cps_agents/results/<problem>.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cps_agents.arena.challenge import Challenge
from cps_baselines.arena import Contestant
from cps_envs.core.types import Role


@dataclass(frozen=True)
class Bar:
    """What a learned policy has to pass: a number, or baselines in the same episodes.

    `every` asks to beat all baselines that the table shows. More is asked of attackers and less of defenders, unless
    `less` says otherwise. The whole interval has to be on the right side, or with `by_mean` the mean.
    """

    beat: tuple[str, ...] = ()  # contestants, each of them
    every: bool = False
    value: float | None = None
    factor: float = 1.0  # of what the contestants reach
    metric: str = ""  # the row's if empty
    less: bool | None = None
    or_equal: bool = False
    by_mean: bool = False
    of: tuple[str, ...] = ()  # the learned contestants that it is for; all if empty


@dataclass(frozen=True)
class Row:
    """A line of a table: one challenge, or several that count equally."""

    title: str
    challenges: tuple[Challenge, ...]
    bars: tuple[Bar, ...] | None = None  # the block's if None; () shows the row without judging it
    metric: str = ""  # the block's if empty
    per: str = ""  # a metric of the same episode that it is divided by; the block's if empty
    bound: str = ""  # what is known to be the best possible, in words
    best_known: float = 0.0  # what the best of all searches reached, of which shares are shown; 0: nothing is known
    without: tuple[str, ...] = ()  # baselines that cannot play it
    headline: bool = False  # stands for the block in summaries; the first judged row if none does


@dataclass(frozen=True)
class Block:
    """One target with everything that is played for it."""

    name: str  # short, lower case
    title: str
    target: str  # what has to be reached, in words
    problem: str
    role: Role
    metric: str
    learned: tuple[Contestant, ...]
    baselines: tuple[Contestant, ...]
    rows: tuple[Row, ...]
    bars: tuple[Bar, ...] = ()
    per: str = ""  # a metric of the same episode that it is divided by
    form: str = "{:.2f}"
    unit: str = ""
    shown: tuple[str, ...] = ()  # further metrics to print beside
    notes: tuple[str, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)  # registered policies that do not play, with the reason

    @property
    def contestants(self) -> tuple[Contestant, ...]:
        """The learned ones, then the baselines."""
        return (*self.learned, *self.baselines)

    def bars_of(self, row: Row) -> tuple[Bar, ...]:
        """What a row is judged by."""
        return self.bars if row.bars is None else row.bars

    def rivals_of(self, bar: Bar) -> tuple[str, ...]:
        """The baselines that a bar asks to beat."""
        return tuple(each.name for each in self.baselines if not each.optimum) if bar.every else bar.beat

    def metric_of(self, row: Row) -> str:
        """What a row shows."""
        return row.metric or self.metric

    def per_of(self, row: Row, metric: str) -> str:
        """What a metric of a row is divided by; nothing if empty."""
        return (row.per or self.per) if metric == self.metric else ""
