"""How often our cells agree with the printed ones, and how often they should: the goals of the specification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.fdi.cells import CollisionPair, solved
from cps_paper.fdi.experiments import ALL_FOUR, FdiEvidence, with_total
from cps_paper.verdicts import BELOW, Check, Reference, Tolerance

ALLOWANCE = 3  # by which a count may fall below its goal, as solves end by time
NOTE = (
    "Cells that agree. feasibility: the target is hit in both or in neither. both: hit in both; of these, pairs: the "
    "same pairs collide, pairs incl.: all printed ones do, speed: the target's within 10 %."
)
COLUMNS = (
    Column("Table", "table"),
    Column("cells", "cells"),
    Column("feasibility", lambda each: each.shown(0), "{}{}"),
    Column("both", "both_feasible"),
    Column("pairs", lambda each: each.shown(1), "{}{}"),
    Column("pairs incl.", lambda each: each.shown(2), "{}{}"),
    Column("speed 10 %", lambda each: each.shown(3), "{}{}"),
)


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
    def checks(self) -> list[Check]:
        """Each count beside its goal."""
        pairs = zip(self.counts, self.goals, strict=True) if self.goals is not None else ()
        return [Check(self.table, count, Reference(goal, Tolerance(ALLOWANCE, BELOW))) for count, goal in pairs]

    @property
    def passed(self) -> bool:
        """Whether no count is more than ALLOWANCE below its goal."""
        return all(each.passed for each in self.checks)

    def shown(self, place: int) -> tuple[str, ...]:
        """A count, and its goal in brackets."""
        goal = "" if self.goals is None else f" ({self.goals[place]})"
        return f"{self.counts[place]}", goal


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


def counted(evidence: FdiEvidence) -> list[TableCounts]:
    """How often our tables agree with the paper, beside the goals that were stated for this solver."""
    settings = evidence.settings
    return count_tables(solved(evidence), GOALS[settings.parameters] if settings.has_goals else None)


def counts_table(evidence: FdiEvidence) -> ExhibitTable:
    """The four counts of every table, with their goals."""
    goals = f"In brackets the goals; a count more than {ALLOWANCE} below its goal fails the command."
    if not evidence.settings.has_goals:
        goals = "Goals were stated for highs, at least 2 s per solve and acceptance 0.45 only."
    title = f"Agreement with the printed tables, set {evidence.settings.parameters}"
    return ExhibitTable(title, COLUMNS, counted(evidence), (NOTE, goals), data=_data)


def _data(each: TableCounts) -> dict[str, Any]:
    return {
        "table": each.table,
        "cells": each.cells,
        "both_feasible": each.both_feasible,
        **each.counts._asdict(),
        "goals": None if each.goals is None else each.goals._asdict(),
        "passed": each.passed,
    }


def count_tables(cells: Mapping[str, Sequence[CollisionPair]], goals: Mapping[str, Counts] | None) -> list[TableCounts]:
    """The counts of each table, after 3.6 those of all tables with four vehicles where all are there."""
    return [_count(row, [cell for each in tables for cell in cells[each]], goals) for row, tables in with_total(cells)]


def _count(table: str, cells: Sequence[CollisionPair], goals: Mapping[str, Counts] | None) -> TableCounts:
    counts = Counts(
        feasibility=sum(cell.feasibility_agrees for cell in cells),
        pairs=sum(cell.pairs_agree for cell in cells),
        pairs_included=sum(cell.pairs_included for cell in cells),
        speed=sum(cell.speed_agrees for cell in cells),
    )
    both = sum(cell.both_feasible for cell in cells)
    return TableCounts(table, len(cells), both, counts, None if goals is None else goals[table])
