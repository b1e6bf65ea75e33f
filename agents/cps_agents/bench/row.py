"""What the bench measures and what comes out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

Values: TypeAlias = Mapping[str, float]


@dataclass(frozen=True)
class Yardsticks:
    """What everything is compared with, measured in the same process shortly before."""

    cartpole_us: float  # CPU time of a step of a single CartPole
    updates_per_s: float  # of the simplest vehicle, see `cps_agents.bench.yardsticks`


@dataclass(frozen=True)
class Row:
    """Something measured; part and name identify it."""

    part: str
    name: str
    values: Values
    note: str = ""


@dataclass(frozen=True)
class Item:
    """Something to be measured, with about so many CPU seconds."""

    part: str
    name: str
    measure: Callable[[float, Yardsticks], Values]
    note: str = ""
