"""Chapter 4 as data: its tables and figures, attacks that come early, the claims and the regression check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from cps_paper.chapter import Chapter, Judged, Reproduction
from cps_paper.claims import CELLS, ClaimTally, tally
from cps_paper.evidence import Experiment
from cps_paper.exhibit import Exhibit, ExhibitTable
from cps_paper.hvac import impacts, measures, plots
from cps_paper.hvac.bars import (
    FIGURES,
    bars_data,
    bars_tables,
    early_data,
    early_table,
    undefended_data,
    undefended_tables,
)
from cps_paper.hvac.cells import errors_data, errors_table, table_rows
from cps_paper.hvac.clear_day import clear_day_table, energies_table
from cps_paper.hvac.controllers import CLIP, HvacEvidence, evidence_under
from cps_paper.hvac.deviation import deviation_days, deviation_table
from cps_paper.hvac.experiments import early_onsets, figure, table_cells
from cps_paper.hvac.observers import observers_table, sets_table
from cps_paper.hvac.rules import CLAIMS, RULES
from cps_paper.hvac.scenario import DayScenario
from cps_paper.hvac.summary import TABLES, closing
from cps_paper.recheck import Condition, varying
from cps_paper.verdicts import Check

# Judged again over days of other seeds. The step of 120 s is printed, and the window, the horizon and the attacks count
# in it: half of it is another plant.
FIRST_SEED, FEWEST_DAYS = 1000, 20


def other_days(usual: DayScenario) -> DayScenario:
    """The same under other seeds; a single day is one without noise."""
    days = usual.days if usual.days == 1 else max(usual.days, FEWEST_DAYS)
    return replace(usual, first_seed=FIRST_SEED, days=days)


SEEDED = f"over other days (at least {FEWEST_DAYS}, seeds from {FIRST_SEED})"
CONDITIONS = (Condition(SEEDED, (varying(DayScenario, other_days),)),)


SOURCES = (impacts,)  # importing them, and what is imported above, registers the functions that check claims


def _table(table: str, *, quick: bool) -> Exhibit[HvacEvidence]:
    return Exhibit(
        table,
        f"Table {table}: tracking errors",
        lambda seen: table_cells(table),
        lambda seen: [errors_table(seen, table)],
        lambda seen: errors_data(seen, table),
        quick=quick,
    )


def _figure(
    number: str,
    about: str,
    tables: Callable[[HvacEvidence], list[ExhibitTable]],
    draw: Callable[[HvacEvidence], Any],
    document: Callable[[HvacEvidence], Any] | None = None,
    *,
    quick: bool = True,
) -> Exhibit[HvacEvidence]:
    name = f"figure_{number.replace('.', '_')}"
    part, about = f"{number}fig", f"Fig. {number}: {about}"
    return Exhibit(part, about, lambda seen: figure(part), tables, document, {name: draw}, quick)


def _bars(num_sensors: int, *, quick: bool) -> Exhibit[HvacEvidence]:
    return _figure(
        f"4.{FIGURES[num_sensors]}",
        f"both defences with {num_sensors} sensors",
        lambda seen: bars_tables(seen, num_sensors),
        lambda seen: plots.draw_defences(seen, num_sensors),
        lambda seen: bars_data(seen, num_sensors),
        quick=quick,
    )


SHOWN = (  # the tables and figures of the chapter
    _table("4.1", quick=True),
    _table("4.2", quick=False),
    _figure("4.2", "attack-free day", lambda seen: [clear_day_table(seen)], plots.draw_clear_day),
    _figure("4.3", "three input energies", lambda seen: [energies_table(seen)], plots.draw_energies),
    _figure("4.4", "attacks without a defence", undefended_tables, plots.draw_undefended, undefended_data),
    _figure("4.5", "the observer with few sensors", lambda seen: [observers_table(seen)], plots.draw_observers),
    _figure("4.6", "sensor sets under a bias", lambda seen: [sets_table(seen)], plots.draw_sets),
    _bars(4, quick=True),
    _bars(8, quick=False),
)


def _behind_claims(seen: HvacEvidence) -> list[Experiment[Any]]:
    """`quick` leaves out Table 4.2 and eight sensors."""
    return [todo for each in SHOWN if each.quick or not seen.quick for todo in each.experiments(seen)]


JUDGED: Judged[HvacEvidence] = Judged(CLAIMS, RULES, _behind_claims, CONDITIONS)
EXHIBITS: tuple[Exhibit[HvacEvidence], ...] = (
    *SHOWN,
    Exhibit(
        "deviation",
        "Table 4.1 with its percentages as standard deviations",
        lambda seen: deviation_days(),
        lambda seen: [deviation_table(seen)],
        quick=False,
    ),
    Exhibit(
        "early",
        "attacks before MTD2 is ready",
        lambda seen: early_onsets(),
        lambda seen: [early_table(seen)],
        early_data,
        quick=False,
    ),
    JUDGED.exhibit,
)


def checks(found: Reproduction[HvacEvidence]) -> list[Check]:
    """The numbers of this run that have a reference: it has the controller that clips."""
    return measures.checks(found.evidence) if found.evidence.controller == CLIP else []


def tallies(found: Reproduction[HvacEvidence]) -> list[ClaimTally]:
    """How many cells of the tables are reproduced."""
    cells = [
        (f"{table} {cell.paper.percent} % {cell.paper.sensors_used} zone {cell.paper.zone}", cell.verdict)
        for table in TABLES
        if table in found.parts
        for row in table_rows(found.evidence, table)
        for cell in row.cells
    ]
    return [tally(found.reading, CELLS, cells)]


def document(found: Reproduction[HvacEvidence]) -> dict[str, Any]:
    """Plain data for JSON."""
    seen = found.evidence
    return {
        "chapter": 4,
        "controller": seen.controller.name,
        "settings": dict(seen.controller.settings),
        "quick": seen.quick,
        "parts": found.data(),
        "again": found.again_data(),
        "regression": {
            "passed": found.passed,
            "inside": sum(each.inside for each in found.checks),
            "checks": list(map(_check, found.checks)),
        },
        "closing": found.closing(),
    }


def _check(check: Check) -> dict[str, Any]:
    reference = check.reference
    return {
        "name": check.label,
        "ours": check.ours,
        "standard_error": check.subject.standard_error,
        "value": reference.value,
        "kind": reference.tolerance.kind,
        "tolerance": reference.tolerance.amount,
        "recorded": reference.recorded,
        "reason": reference.reason,
        "inside": check.inside,
        "passed": check.passed,
    }


CHAPTER: Chapter[HvacEvidence] = Chapter(
    title="chapter 4",
    evidence=evidence_under,
    reading=lambda seen: seen.controller.reading,
    exhibits=EXHIBITS,
    closing=closing,
    document=document,
    checks=checks,
    judged=JUDGED,
    tallies=tallies,
)
