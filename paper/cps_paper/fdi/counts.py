"""How often our cells agree with the printed ones, and how often they did when the reference was made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.fdi.cells import CollisionPair, solved
from cps_paper.fdi.experiments import ALL_FOUR, FITTED, TABLES, CircleRun, FdiEvidence, with_total
from cps_paper.printed.tables import CollisionCell, collision_cells
from cps_paper.verdicts import ABSOLUTE, GIVEN, NOT, OPEN, Check, Reference, Tolerance

ALLOWANCE = 3  # by which a count may differ: another version of the solver searches otherwise
NOTE = (
    "Cells that agree. feasibility: the target is hit in both or in neither; open: the search ended before it could "
    "tell. both: hit in both; of these, pairs: the same pairs collide, pairs incl.: all printed ones do, speed: the "
    "best attack is within 10 % of the printed speed; beyond: the printed speed is higher than the certified bound."
)
COLUMNS = (
    Column("Table", "table"),
    Column("cells", "cells"),
    Column("feasibility", "counts.feasibility"),
    Column("open", "counts.open"),
    Column("both", "both_feasible"),
    Column("pairs", "counts.pairs"),
    Column("pairs incl.", "counts.pairs_included"),
    Column("speed 10 %", "counts.speed"),
    Column("beyond", "beyond"),
)


class Counts(NamedTuple):
    """The counts of a table."""

    feasibility: int  # cells in which both have a collision of the target, or neither has
    open: int  # cells in which nobody knows
    pairs: int  # of those with a collision in both: the same pairs
    pairs_included: int  # all printed pairs among ours
    speed: int  # target's speed within 10 %


@dataclass(frozen=True)
class TableCounts:
    """The counts of a table, or of all tables with four vehicles, beside their reference."""

    table: str
    cells: int
    both_feasible: int  # cells that the last three counts are out of
    beyond: int  # printed speeds above the bound
    counts: Counts
    reference: Counts | None  # none for other settings

    @property
    def checks(self) -> list[Check]:
        """Each count beside its reference."""
        pairs = zip(self.counts, self.reference, strict=True) if self.reference is not None else ()
        return [Check(self.table, count, Reference(goal, Tolerance(ALLOWANCE, ABSOLUTE))) for count, goal in pairs]

    @property
    def passed(self) -> bool:
        """Whether every count is within ALLOWANCE of its reference."""
        return all(each.passed for each in self.checks)


REFERENCE: Mapping[str, Mapping[str, Counts]] = {
    "A": {
        "3.1": Counts(13, 0, 4, 5, 2),
        "3.2": Counts(14, 0, 6, 6, 0),
        "3.3": Counts(23, 0, 5, 19, 5),
        "3.4": Counts(21, 1, 7, 17, 3),
        "3.5": Counts(14, 0, 2, 4, 0),
        "3.6": Counts(14, 0, 6, 11, 0),
        "3.7": Counts(32, 1, 6, 23, 5),
        ALL_FOUR: Counts(99, 1, 30, 62, 10),
    },
    "B": {
        "3.1": Counts(11, 0, 4, 5, 2),
        "3.2": Counts(12, 0, 3, 5, 0),
        "3.3": Counts(24, 0, 3, 18, 3),
        "3.4": Counts(22, 0, 6, 18, 3),
        "3.5": Counts(12, 0, 3, 5, 1),
        "3.6": Counts(15, 0, 8, 11, 1),
        ALL_FOUR: Counts(96, 0, 27, 62, 10),
    },
}


def counted(evidence: FdiEvidence) -> list[TableCounts]:
    """How often our tables agree with the paper."""
    settings = evidence.settings
    return count_tables(solved(evidence), REFERENCE[settings.parameters] if settings.has_reference else None)


def counts_table(evidence: FdiEvidence) -> ExhibitTable:
    """The counts of every table."""
    horizon = evidence.settings.config("3.1").horizon
    title = f"Agreement with the printed tables, set {evidence.settings.parameters}, m = {horizon} for all"
    return ExhibitTable(title, COLUMNS, counted(evidence), (NOTE,), data=_data)


def _data(each: TableCounts) -> dict[str, Any]:
    return {
        "table": each.table,
        "cells": each.cells,
        "both_feasible": each.both_feasible,
        "beyond": each.beyond,
        **each.counts._asdict(),
        "reference": None if each.reference is None else each.reference._asdict(),
        "passed": each.passed,
    }


def count_tables(
    cells: Mapping[str, Sequence[CollisionPair]], reference: Mapping[str, Counts] | None
) -> list[TableCounts]:
    """The counts of each table, after 3.6 those of all tables with four vehicles where all are there."""
    return [
        _count(row, [cell for each in tables for cell in cells[each]], reference) for row, tables in with_total(cells)
    ]


def _count(table: str, cells: Sequence[CollisionPair], reference: Mapping[str, Counts] | None) -> TableCounts:
    counts = Counts(
        feasibility=sum(cell.feasibility_agrees for cell in cells),
        open=sum(cell.open for cell in cells),
        pairs=sum(cell.pairs_agree for cell in cells),
        pairs_included=sum(cell.pairs_included for cell in cells),
        speed=sum(cell.both_feasible and cell.speed_agrees is True for cell in cells),
    )
    both, beyond = sum(cell.both_feasible for cell in cells), sum(cell.beyond for cell in cells)
    return TableCounts(table, len(cells), both, beyond, counts, None if reference is None else reference[table])


def fitted_verdicts(evidence: FdiEvidence, table: str) -> list[tuple[CollisionCell, str]]:
    """Each cell of a table at its fitted horizon: agreement on whether the target can be hit is by construction.

    Raises:
        NotRunError: the fitted horizons were left out.
    """
    found = []
    for cell in collision_cells(table):
        hit = evidence[CircleRun(evidence.settings, table, cell.task, fitted=True)].hit
        found.append((cell, OPEN if hit is None else GIVEN if hit == cell.feasible else NOT))
    return found


def fitted_table(evidence: FdiEvidence) -> ExhibitTable:
    """The one thing that the fitted horizons are for."""
    rows = [
        (row, [verdict for table in tables for _, verdict in fitted_verdicts(evidence, table)])
        for row, tables in with_total(TABLES)
    ]
    columns = (
        Column("Table", lambda each: each[0]),
        Column("m", lambda each: FITTED.get(each[0])),
        Column("cells", lambda each: len(each[1])),
        Column("by construction", lambda each: each[1].count(GIVEN)),
        Column("other", lambda each: each[1].count(NOT)),
        Column("open", lambda each: each[1].count(OPEN)),
    )
    note = (
        "Whether the target can be hit, with a horizon for each table that was chosen so that most cells agree: "
        "agreement is by construction and supports nothing."
    )
    title = "The fitted horizons, set A"
    return ExhibitTable(title, columns, rows, (note,), data=lambda each: {"table": each[0], "verdicts": each[1]})
