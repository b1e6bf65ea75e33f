"""How often our cells agree with the printed ones, and how often they should: the goals of the specification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from cps_baselines.fdi.reproduction.cells import Cell
from cps_baselines.fdi.reproduction.settings import ALL_FOUR, FOUR_VEHICLES

ALLOWANCE = 3  # by which a count may fall below its goal, as solves end by time


class Counts(NamedTuple):
    """The four counts of a table."""

    feasibility: int  # cells in which both have a collision of the target, or neither has
    pairs: int  # of these with a collision: the same pairs
    pairs_included: int  # all printed pairs among ours
    speed: int  # target's speed within 10 %


@dataclass(frozen=True)
class TableCounts:
    """The counts of a table, or of all tables with four vehicles, beside their goals."""

    table: str
    cells: int
    both_feasible: int  # cells that the last three counts are out of
    counts: Counts
    goals: Counts | None  # none were stated for this solver

    @property
    def passed(self) -> bool:
        """Whether no count is more than ALLOWANCE below its goal."""
        return self.goals is None or all(
            count >= goal - ALLOWANCE for count, goal in zip(self.counts, self.goals, strict=True)
        )


GOALS: Mapping[str, Mapping[str, Counts]] = {
    "A": {
        "3.1": Counts(16, 5, 5, 2),
        "3.2": Counts(14, 5, 5, 2),
        "3.3": Counts(23, 8, 16, 9),
        "3.4": Counts(22, 9, 15, 4),
        "3.5": Counts(15, 3, 4, 2),
        "3.6": Counts(20, 5, 6, 2),
        "3.7": Counts(42, 16, 20, 5),
        ALL_FOUR: Counts(110, 35, 51, 21),
    },
    "B": {
        "3.1": Counts(16, 4, 5, 2),
        "3.2": Counts(15, 5, 5, 2),
        "3.3": Counts(24, 10, 15, 6),
        "3.4": Counts(23, 10, 15, 3),
        "3.5": Counts(15, 3, 4, 3),
        "3.6": Counts(22, 7, 9, 4),
        "3.7": Counts(44, 12, 20, 2),
        ALL_FOUR: Counts(115, 39, 53, 20),
    },
}


def count_tables(cells: Mapping[str, Sequence[Cell]], goals: Mapping[str, Counts] | None) -> list[TableCounts]:
    """The counts of each table, after 3.6 those of all tables with four vehicles where all are there."""
    found = []
    for table, members in cells.items():
        found.append(_count(table, members, goals))
        if table == FOUR_VEHICLES[-1] and set(FOUR_VEHICLES) <= set(cells):
            every = [cell for each in FOUR_VEHICLES for cell in cells[each]]
            found.append(_count(ALL_FOUR, every, goals))
    return found


def _count(table: str, cells: Sequence[Cell], goals: Mapping[str, Counts] | None) -> TableCounts:
    counts = Counts(
        feasibility=sum(cell.feasibility_agrees for cell in cells),
        pairs=sum(cell.pairs_agree for cell in cells),
        pairs_included=sum(cell.pairs_included for cell in cells),
        speed=sum(cell.speed_agrees for cell in cells),
    )
    both = sum(cell.both_feasible for cell in cells)
    return TableCounts(table, len(cells), both, counts, None if goals is None else goals[table])
