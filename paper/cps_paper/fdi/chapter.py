"""Chapter 3 as data: its tables cell by cell, their audit, Fig. 3.2, and rules that know less beside our counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from cps_paper.chapter import Chapter, Reproduction
from cps_paper.claims import CELLS, CLAIMS, ClaimTally, tally
from cps_paper.evidence import Experiment
from cps_paper.exhibit import Exhibit
from cps_paper.fdi.audit import audit_data, audit_tables
from cps_paper.fdi.cells import cells_table, grid_runs, solved
from cps_paper.fdi.continuous import compared, continuous_data, continuous_table, verdict
from cps_paper.fdi.controls import controls_table
from cps_paper.fdi.counts import counted, counts_table
from cps_paper.fdi.experiments import (
    FOUR_VEHICLES,
    ONE_HORIZON,
    RELAXED,
    TABLES,
    FdiEvidence,
    FdiSettings,
    OneHorizonRun,
    RelaxedSpeeds,
)
from cps_paper.fdi.figure_3_2 import draw_figure, figure_rows, figure_runs, figure_table, main_rows
from cps_paper.fdi.summary import AUDIT, FIGURE, closing
from cps_paper.printed.tables import collision_cells
from cps_paper.verdicts import Check

ONE_ATTACKED = ("3.1", "3.2", "3.5")  # the tables with one attacked vehicle


def evidence(
    *,
    quick: bool = False,
    preset_set: str = "A",
    time_limit: float = 2.0,
    acceptance: float = 0.45,
) -> FdiEvidence:
    """Solved with these settings; `quick` leaves out the control with one horizon.

    Raises:
        ConfigurationError: see `FdiSettings`.
    """
    return FdiEvidence(quick=quick, settings=FdiSettings(preset_set, time_limit, acceptance))


def _table(table: str) -> Exhibit[FdiEvidence]:
    def experiments(seen: FdiEvidence) -> list[Experiment[Any]]:
        todo: list[Experiment[Any]] = [*grid_runs(seen.settings, table)]
        if table in FOUR_VEHICLES:
            todo.append(RelaxedSpeeds(RELAXED))
            todo += [] if seen.quick else [OneHorizonRun(cell.task) for cell in collision_cells(table)]
        return todo

    about = f"Table {table}, with the agreement of all tables"
    return Exhibit(table, about, experiments, lambda seen: [cells_table(seen, table)], quick=table in ONE_ATTACKED)


def _beside(name: str, about: str, tables: Callable[[FdiEvidence], Any], data: Any = None) -> Exhibit[FdiEvidence]:
    """What follows from the tables that were solved."""
    return Exhibit(name, about, lambda seen: (), tables, data, given=lambda seen: bool(solved(seen)))


EXHIBITS: tuple[Exhibit[FdiEvidence], ...] = (
    *map(_table, TABLES),
    _beside("counts", "how often we agree", lambda seen: [counts_table(seen)]),
    _beside("controls", "how often simpler rules agree", lambda seen: [controls_table(seen)]),
    _beside("continuous", "injections of any size", lambda seen: [continuous_table()], lambda seen: continuous_data()),
    Exhibit(
        AUDIT,
        "the printed tables against one another",
        lambda seen: [RelaxedSpeeds(ONE_HORIZON)],
        audit_tables,
        audit_data,
    ),
    Exhibit(
        FIGURE,
        "Fig. 3.2: Algorithm 2 against the lead of ten vehicles",
        lambda seen: figure_runs(),
        lambda seen: [figure_table(seen)],
        figures={"figure_3_2": lambda seen: draw_figure(main_rows(figure_rows(seen)))},
    ),
)


def checks(found: Reproduction[FdiEvidence]) -> list[Check]:
    """All counts that have a goal; single cells that differ do not count."""
    return [check for each in counted(found.evidence) for check in each.checks]


def tallies(found: Reproduction[FdiEvidence]) -> list[ClaimTally]:
    """How many cells of the tables are reproduced, and what else the chapter states."""
    tables, reading = solved(found.evidence), found.reading
    cells = [
        (f"{table} {cell.paper.task.sensors}>{cell.paper.task.target}", cell.verdict)
        for table, each in tables.items()
        for cell in each
    ]
    rows = main_rows(figure_rows(found.evidence)) if FIGURE in found.parts else []
    claims = [(f"Fig. 3.2, {row.paper.sensors}", row.verdict) for row in rows]
    claims += [("continuous injections are stronger", verdict(compared()))] if tables else []
    return [tally(reading, CLAIMS, claims), tally(reading, CELLS, cells)]


def document(found: Reproduction[FdiEvidence]) -> dict[str, Any]:
    """Plain data for JSON."""
    seen, data = found.evidence, found.data()
    beside = {each.name: each.data(seen) for each in EXHIBITS if each.given}
    return {
        "chapter": 3,
        "settings": asdict(seen.settings),
        "quick": seen.quick,
        "parts": {name: data[name] for name in (*TABLES, FIGURE, AUDIT) if name in data},
        **beside,
        "passed": found.passed,
        "closing": found.closing(),
    }


CHAPTER: Chapter[FdiEvidence] = Chapter(
    title="chapter 3",
    evidence=evidence,
    reading=lambda seen: f"set {seen.settings.parameters}",
    exhibits=EXHIBITS,
    closing=closing,
    document=document,
    checks=checks,
    tallies=tallies,
)
