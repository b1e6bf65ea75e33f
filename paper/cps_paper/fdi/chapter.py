"""Chapter 3 as data: its tables cell by cell, their audit, Fig. 3.2, and rules that know less beside our counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from cps_paper.chapter import Chapter, Reproduction
from cps_paper.claims import CELLS, CLAIMS, FITTED, ClaimTally, tally
from cps_paper.evidence import Experiment
from cps_paper.exhibit import Exhibit, ExhibitTable
from cps_paper.fdi.audit import audit_data, audit_tables
from cps_paper.fdi.cells import cells_table, circle_runs, solved
from cps_paper.fdi.continuous import compared, continuous_data, continuous_table, verdict
from cps_paper.fdi.controls import controls_table
from cps_paper.fdi.counts import counted, counts_table, fitted_table, fitted_verdicts
from cps_paper.fdi.experiments import (
    FOUR_VEHICLES,
    ONE_HORIZON,
    RELAXED,
    TABLES,
    CircleRun,
    FdiEvidence,
    FdiSettings,
    RelaxedSpeeds,
)
from cps_paper.fdi.figure_3_2 import draw_figure, figure_rows, figure_runs, figure_table, main_rows
from cps_paper.fdi.more_sensors import compared_sensors, sensors_data, sensors_table
from cps_paper.fdi.summary import AUDIT, FIGURE, HORIZONS, closing
from cps_paper.printed.tables import collision_cells
from cps_paper.verdicts import Check

ONE_ATTACKED = ("3.1", "3.2", "3.5")  # the tables with one attacked vehicle


def evidence(
    *,
    quick: bool = False,
    preset_set: str = "A",
    nodes: int = 100,
    acceptance: float = 0.45,
) -> FdiEvidence:
    """Judged with these settings; `quick` says that less was asked for.

    Raises:
        ConfigurationError: see `FdiSettings`.
    """
    return FdiEvidence(quick=quick, settings=FdiSettings(preset_set, nodes, acceptance))


def _table(table: str) -> Exhibit[FdiEvidence]:
    def experiments(seen: FdiEvidence) -> list[Experiment[Any]]:
        if table not in seen.settings.tables:
            return []
        relaxed = [RelaxedSpeeds(RELAXED)] if table in FOUR_VEHICLES else []
        return [*circle_runs(seen.settings, table), *relaxed]

    def tables(seen: FdiEvidence) -> list[ExhibitTable]:
        return [cells_table(seen, table)] if table in seen.settings.tables else []

    about = f"Table {table}, with the agreement of all tables"
    return Exhibit(table, about, experiments, tables, quick=table in ONE_ATTACKED)


def _beside(name: str, about: str, tables: Callable[[FdiEvidence], Any], data: Any = None) -> Exhibit[FdiEvidence]:
    """What follows from the tables that were solved."""
    return Exhibit(name, about, lambda seen: (), tables, data, given=lambda seen: bool(solved(seen)))


def _fitted_runs(seen: FdiEvidence) -> list[Experiment[Any]]:
    if seen.settings.parameters != "A":
        return []
    return [
        CircleRun(seen.settings, table, cell.task, fitted=True) for table in TABLES for cell in collision_cells(table)
    ]


EXHIBITS: tuple[Exhibit[FdiEvidence], ...] = (
    *map(_table, TABLES),
    Exhibit(
        HORIZONS,
        "the tables at a horizon of their own, which was fitted",
        _fitted_runs,
        lambda seen: [fitted_table(seen)] if _fitted_runs(seen) else [],
        quick=False,
    ),
    _beside("counts", "how often we agree", lambda seen: [counts_table(seen)]),
    _beside("controls", "how often simpler rules agree", lambda seen: [controls_table(seen)]),
    _beside("sensors", "two sensors against one", lambda seen: [sensors_table()], lambda seen: sensors_data()),
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
    if tables:
        claims += [("continuous injections are stronger", verdict(compared()))]
        claims += [(each.claim, each.verdict) for each in compared_sensors()]
    fitted = _fitted_cells(found) if HORIZONS in found.parts and _fitted_runs(found.evidence) else []
    return [tally(reading, CLAIMS, claims), tally(reading, CELLS, cells), tally(reading, FITTED, fitted)]


def _fitted_cells(found: Reproduction[FdiEvidence]) -> list[tuple[str, str]]:
    return [
        (f"{table} {cell.task.sensors}>{cell.task.target}", verdict)
        for table in TABLES
        for cell, verdict in fitted_verdicts(found.evidence, table)
    ]


def document(found: Reproduction[FdiEvidence]) -> dict[str, Any]:
    """Plain data for JSON."""
    seen, data = found.evidence, found.data()
    beside = {each.name: each.data(seen) for each in EXHIBITS if each.given}
    return {
        "chapter": 3,
        "settings": asdict(seen.settings),
        "quick": seen.quick,
        "parts": {name: data[name] for name in (*TABLES, HORIZONS, FIGURE, AUDIT) if name in data},
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
