"""Rules that know less than we do, and how often they agree with the printed tables about feasibility."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from cps_paper.evidence import NotRunError
from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.fdi.cells import solved
from cps_paper.fdi.counts import counted
from cps_paper.fdi.experiments import RELAXED, FdiEvidence, RelaxedSpeeds, with_total
from cps_paper.printed.tables import CollisionCell, collision_cells

FASTEST_MPS = 1.75  # an impact slower than this counts as none; inferred from the printed speeds
NOTE = (
    "Cells whose feasibility agrees with the paper. target attacked: feasible iff the target is an attacked vehicle. "
    f"C, LP: set C, m = 25, feasible iff the relaxation reaches {FASTEST_MPS:g} m/s. any: feasible iff an attack is "
    f"known, {FASTEST_MPS:g} m/s: iff one of that speed is known; by the certificates of our set."
)


@dataclass(frozen=True)
class TableControls:
    """Cells of a table whose feasibility agrees with the paper; None where a rule was not computed."""

    table: str
    cells: int
    target_attacked: int  # feasible iff the target is an attacked vehicle
    relaxed: int | None  # set C, linear programs, at FASTEST_MPS
    any_attack: int  # feasible iff the certificates have an attack
    fast_attack: int  # the same at FASTEST_MPS


def controls_table(evidence: FdiEvidence) -> ExhibitTable:
    """Feasibility by rules that know less, beside ours."""
    ours = {each.table: each.counts.feasibility for each in counted(evidence)}
    columns = (
        Column("Table", "table"),
        Column("cells", "cells"),
        Column("ours", lambda each: ours.get(each.table)),
        Column("target attacked", "target_attacked"),
        Column("C, LP", "relaxed"),
        Column("any", "any_attack"),
        Column(f"{FASTEST_MPS:g} m/s", "fast_attack"),
    )
    return ExhibitTable(
        "Control rules", columns, control_tables(evidence, list(solved(evidence))), (NOTE,), data=asdict
    )


def control_tables(evidence: FdiEvidence, tables: Sequence[str]) -> list[TableControls]:
    """The rules on each table, after 3.6 on all tables with four vehicles where all are asked for."""
    return [
        _controls(evidence, row, [cell for each in members for cell in collision_cells(each)])
        for row, members in with_total(tables)
    ]


def _controls(evidence: FdiEvidence, table: str, cells: Sequence[CollisionCell]) -> TableControls:
    def relaxed(cell: CollisionCell) -> bool:
        return (evidence[RelaxedSpeeds(RELAXED)][cell.task] or 0.0) >= FASTEST_MPS

    def known_mps(cell: CollisionCell) -> float:
        record = evidence.settings.certificates(cell.table)[cell.task]
        return -1.0 if record.value_mps is None else record.value_mps

    def agreeing(rule: Callable[[CollisionCell], bool]) -> int:
        return sum(rule(cell) == cell.feasible for cell in cells)

    try:
        by_programs: int | None = agreeing(relaxed)
    except (NotRunError, KeyError):
        by_programs = None
    return TableControls(
        table,
        len(cells),
        agreeing(lambda cell: cell.task.target in cell.task.sensors.vehicles),
        by_programs,
        agreeing(lambda cell: known_mps(cell) >= 0.0),
        agreeing(lambda cell: known_mps(cell) >= FASTEST_MPS),
    )
