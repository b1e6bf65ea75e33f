"""Reproducing chapter 3, or parts of it: solve, compare, and hand over as tables, words or plain data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from cps_baselines.fdi.reproduction import blocks, document
from cps_baselines.fdi.reproduction.audit import Comparison, beyond_relaxation, comparisons
from cps_baselines.fdi.reproduction.cells import Cell, table_cells
from cps_baselines.fdi.reproduction.continuous import Continuous, compared, verdict
from cps_baselines.fdi.reproduction.controls import TableControls, control_tables
from cps_baselines.fdi.reproduction.counts import GOALS, TableCounts, count_tables
from cps_baselines.fdi.reproduction.experiments import RelaxedSpeeds, four_vehicle_cells
from cps_baselines.fdi.reproduction.figure import FigureRow, figure_rows, main_rows
from cps_baselines.fdi.reproduction.selection import AUDIT, FIGURE, needed, tables_of
from cps_baselines.fdi.reproduction.settings import ONE_HORIZON, Settings
from cps_baselines.fdi.reproduction.summary import closing
from cps_baselines.paper.collisions import CollisionCell
from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.evidence import Evidence, Report, compute
from cps_baselines.reproduction.tally import CELLS, CLAIMS, Tally, tally


@dataclass(frozen=True)
class Reproduction:
    """Parts of the chapter, solved with one setting."""

    parts: Sequence[str]
    evidence: Evidence
    settings: Settings
    quick: bool = False

    @cached_property
    def cells(self) -> dict[str, list[Cell]]:
        """The cells of the tables asked for."""
        return {table: table_cells(self.evidence, self.settings, table) for table in tables_of(self.parts)}

    @cached_property
    def counts(self) -> list[TableCounts]:
        """How often they agree with the paper."""
        return count_tables(self.cells, GOALS[self.settings.parameters] if self.settings.has_goals else None)

    @cached_property
    def controls(self) -> list[TableControls]:
        """How often simpler rules agree."""
        return control_tables(self.evidence, tables_of(self.parts))

    @cached_property
    def comparisons(self) -> list[Comparison]:
        """The printed tables against one another, if asked for."""
        return comparisons() if AUDIT in self.parts else []

    @cached_property
    def beyond(self) -> list[tuple[CollisionCell, float | None]]:
        """Printed speeds that set A cannot reach, if asked for."""
        return list(beyond_relaxation(self.evidence[RelaxedSpeeds(ONE_HORIZON)])) if AUDIT in self.parts else []

    @cached_property
    def rows(self) -> list[FigureRow]:
        """Fig. 3.2, if asked for."""
        return figure_rows(self.evidence) if FIGURE in self.parts else []

    @cached_property
    def continuous(self) -> list[Continuous]:
        """Continuous injections against the shipped optima."""
        return compared()

    @property
    def passed(self) -> bool:
        """Whether no count is more than the allowance below its goal; single cells that differ do not count."""
        return all(each.passed for each in self.counts)

    def tallies(self) -> list[Tally]:
        """How many cells of the tables are reproduced, and what else the chapter states."""
        reading = f"set {self.settings.parameters}"
        cells = [
            (f"{table} {cell.paper.task.sensors}>{cell.paper.task.target}", cell.verdict)
            for table, each in self.cells.items()
            for cell in each
        ]
        figure = [(f"Fig. 3.2, {row.paper.sensors}", row.verdict) for row in main_rows(self.rows)]
        continuous = [("continuous injections are stronger", verdict(self.continuous))] if self.cells else []
        return [tally(reading, CLAIMS, [*figure, *continuous]), tally(reading, CELLS, cells)]

    def blocks(self) -> list[Block]:
        """Tables for readers."""
        made = blocks.cell_blocks(self.cells, self.settings)
        if self.cells:
            made += [
                blocks.counts_block(self.counts, self.settings),
                blocks.controls_block(self.controls, self.counts),
                blocks.continuous_block(self.continuous),
            ]
        if AUDIT in self.parts:
            made += [blocks.audit_block(self.comparisons), blocks.beyond_block(self.beyond, _printed_speeds())]
        return made + ([blocks.figure_block(self.rows)] if self.rows else [])

    def closing(self) -> list[str]:
        """Paragraphs that say what is not reproducible, and why."""
        found = (self.counts, self.controls, self.comparisons, self.rows, self.settings, self.continuous)
        return closing(*found, quick=self.quick)

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        audited = document.audit_document(self.comparisons, self.beyond, _printed_speeds())
        return {
            "chapter": 3,
            "settings": document.settings_document(self.settings),
            "quick": self.quick,
            "parts": {
                **{table: document.cells_document(cells) for table, cells in self.cells.items()},
                **({FIGURE: document.figure_document(self.rows)} if self.rows else {}),
                **({AUDIT: audited} if AUDIT in self.parts else {}),
            },
            "counts": document.counts_document(self.counts),
            "controls": document.controls_document(self.controls),
            "continuous": document.continuous_document(self.continuous),
            "passed": self.passed,
            "closing": self.closing(),
        }

    def figures(self) -> Iterator[tuple[str, Any]]:
        """Names of the figures asked for, and the figures."""
        from cps_baselines.fdi.reproduction.plot_3_2 import draw

        if self.rows:
            yield "figure_3_2", draw(main_rows(self.rows))


def reproduce_chapter(
    parts: Sequence[str],
    settings: Settings,
    *,
    jobs: int = 1,
    quick: bool = False,
    report: Report | None = None,
) -> Reproduction:
    """Solve what the parts (of `selection.PARTS`) need.

    `jobs` processes share the work; they are spawned, so a script must guard its main part. `report` is told the share
    of the work done. `quick` leaves out the control with one horizon.
    """
    return Reproduction(
        tuple(parts), Evidence(compute(needed(parts, settings, quick=quick), jobs, report)), settings, quick
    )


def _printed_speeds() -> int:
    return sum(cell.feasible for cell in four_vehicle_cells())
