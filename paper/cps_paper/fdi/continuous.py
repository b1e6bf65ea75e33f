"""What the text says of continuous injections, that they reach more and hit faster, checked on the shipped optima."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from cps_envs.fdi.config import A
from cps_envs.fdi.optima import INFEASIBLE, PROVED, Record, known
from cps_paper.exhibit import Column, ExhibitTable, with_properties
from cps_paper.fdi.interpretations import CLIP
from cps_paper.verdicts import NOT, PARTLY, SAME_SHARE

CONFIGS = {"preset paper": A, "clipped limits": CLIP}  # those whose optima were searched longest


@dataclass(frozen=True)
class Continuous:
    """Linear programs, which allow any injection, against integer ones on the same tasks."""

    constants: str  # by name, see CONFIGS
    tasks: int
    reached: int  # by continuous injections
    known: int  # of these, by known injections that obey the resolution
    unreachable: int  # of these, proved out of reach with the resolution
    ratios: tuple[float, ...]  # highest impact speed, continuous over whole, of the tasks whose optimum is proved

    @property
    def unsettled(self) -> int:
        """Tasks that continuous injections reach, while nobody knows whether others do."""
        return self.reached - self.known - self.unreachable

    @property
    def reaches_more(self) -> bool:
        """Whether continuous injections reach more tasks, however the unsettled ones turn out."""
        return self.unreachable > 0

    @property
    def notably_faster(self) -> int:
        """Of the proved tasks, those hit faster by more than SAME_SHARE."""
        return sum(ratio > 1.0 + SAME_SHARE for ratio in self.ratios)

    @property
    def mean_ratio(self) -> float:
        """Over the proved tasks."""
        return float(np.mean(self.ratios))

    @property
    def faster(self) -> bool:
        """Whether all proved tasks are hit at least as fast, and some faster by more than SAME_SHARE."""
        return min(self.ratios) >= 1.0 - 1e-6 and self.notably_faster > 0


def verdict(found: Iterable[Continuous]) -> str:
    """Partly at best: the paper prints no numbers, and the direction is that of any relaxation."""
    return PARTLY if all(each.reaches_more and each.faster for each in found) else NOT


def continuous_table() -> ExhibitTable:
    """Continuous injections against those that obey the resolution."""
    return ExhibitTable("Continuous injections against the resolution", COLUMNS, compared(), (NOTE,))


def continuous_data() -> dict[str, Any]:
    """The same for JSON, and the verdict."""
    data = with_properties("unsettled", "mean_ratio", "notably_faster")
    return {"constants": list(map(data, compared())), "verdict": verdict(compared())}


COLUMNS = (
    Column("Constants", "constants"),
    Column("tasks", "tasks"),
    Column("continuous", "reached"),
    Column("known", "known"),
    Column("unreachable", "unreachable"),
    Column("open", "unsettled"),
    Column("proved", lambda each: len(each.ratios)),
    Column("faster", "notably_faster"),
    Column("mean", "mean_ratio", "{:.3f}"),
    Column("largest", lambda each: max(each.ratios), "{:.3f}"),
)
NOTE = (
    "Tasks that continuous injections reach; of these: reached by a known plan that obeys the resolution, proved out "
    "of its reach, open. Of those with a proved optimum: how many continuous injections hit more than "
    f"{100 * SAME_SHARE:g} % faster, and their highest impact speed over the optimum. Optima of `cps-envs certify`, "
    "with one horizon for all tasks."
)


@lru_cache(maxsize=1)
def compared() -> list[Continuous]:
    """The configurations whose optima are shipped."""
    return [compare(name, known(config).values()) for name, config in CONFIGS.items()]


def compare(constants: str, records: Iterable[Record]) -> Continuous:
    """One configuration."""
    every = list(records)
    reached = [record for record in every if record.lp_mps is not None]
    return Continuous(
        constants,
        len(every),
        len(reached),
        sum(record.feasible for record in reached),
        sum(record.status == INFEASIBLE for record in reached),
        tuple(
            record.lp_mps / record.value_mps
            for record in reached
            if record.status == PROVED and record.lp_mps is not None and record.value_mps
        ),
    )
