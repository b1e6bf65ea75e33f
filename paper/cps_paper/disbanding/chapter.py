"""Chapter 2 as data: its tables and figures, what is played beside them, the optimal attacks, and the claims."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cps_envs.disbanding.config import INTERPRETATIONS
from cps_paper.chapter import Chapter, Judged, Reproduction
from cps_paper.claims import CELLS, EFFECTS, ClaimTally, tally
from cps_paper.disbanding import claims_2_1, claims_2_3, plots
from cps_paper.disbanding.cells import (
    BASELINE,
    baselines_data,
    baselines_table,
    cells_data,
    cells_tables,
    table_cells,
)
from cps_paper.disbanding.cells import checks as cell_checks
from cps_paper.disbanding.experiments import FIGURE_TAUS_S, PLATOONS, DisbandingEvidence
from cps_paper.disbanding.optimal import optima_table
from cps_paper.disbanding.played_tables import (
    platoons_data,
    platoons_tables,
    readings_data,
    readings_tables,
)
from cps_paper.disbanding.rules import CLAIMS, CONDITIONS, RULES
from cps_paper.disbanding.scenario import ScenarioOutcome
from cps_paper.disbanding.string_stability import draw_stability, stability_data, stability_tables
from cps_paper.disbanding.strings import courses_tables
from cps_paper.disbanding.summary import cells_of, closing
from cps_paper.disbanding.tried import tried, tried_data, tried_tables
from cps_paper.evidence import Experiment
from cps_paper.exhibit import Column, Exhibit, ExhibitTable, across
from cps_paper.verdicts import Check

SOURCES = (claims_2_1, claims_2_3)  # importing them registers the functions that check the claims


def _table(table: str, about: str) -> Exhibit[DisbandingEvidence]:
    return Exhibit(
        table,
        f"Table {table}: {about}",
        lambda seen: seen.table(table),
        lambda seen: cells_tables(seen, table),
        lambda seen: cells_data(table_cells(seen, table)),
    )


def sweep_tables(seen: DisbandingEvidence) -> list[ExhibitTable]:
    """What Fig. 2.3 shows, in numbers."""
    columns = (
        Column("", lambda each: each[0].figure, "Fig. {}"),
        Column("paper", lambda each: each[0].paper),
        Column("ours", lambda each: each[1].shown),
        Column("verdict", lambda each: each[1].verdict),
    )
    intact = "Fig. 2.3c: E_v in percent over intact vehicles, lead platoon disbanded at 1 s"
    return [
        ExhibitTable("Figs. 2.3a, b: E_v in percent", columns, CLAIMS.evaluate(seen, ("P21", "P22"))),
        _sweep(seen, intact, lambda outcome: f"{outcome.velocity_error_intact:.2f}"),
        _sweep(seen, "Fig. 2.3d: vehicles involved in collisions", lambda outcome: str(int(outcome.collided.sum()))),
    ]


def _sweep(seen: DisbandingEvidence, title: str, shown: Callable[[ScenarioOutcome], str]) -> ExhibitTable:
    counts = across(PLATOONS, str, lambda tau_s, count: shown(seen[seen.single(count, tau_s)]))
    return ExhibitTable(title, (Column("tau \\ N", float, "{:g} s"), *counts), FIGURE_TAUS_S)


def sweep_data(seen: DisbandingEvidence) -> list[dict[str, Any]]:
    """Figs. 2.3c and d, point by point, for JSON."""
    return [
        {
            "tau_s": tau_s,
            "num_platoons": count,
            "velocity_error_intact": outcome.velocity_error_intact,
            "velocity_error_all": outcome.velocity_error_all,
            "collided": int(outcome.collided.sum()),
        }
        for tau_s in FIGURE_TAUS_S
        for count in PLATOONS
        for outcome in [seen[seen.single(count, tau_s)]]
    ]


def _searches(seen: DisbandingEvidence) -> list[Experiment[Any]]:
    """`quick` leaves out the grid of alternative attacks and all but one search."""
    return [*seen.searches(), *seen.paper_plans(), *([] if seen.quick else seen.two_platoons())]


def _behind_claims(seen: DisbandingEvidence) -> list[Experiment[Any]]:
    """`quick` leaves out long strings and the grids of alternative attacks."""
    todo = [*seen.table("2.2"), *seen.table("2.3"), *seen.figure_2_1(), *seen.figure_2_3()]
    return todo if seen.quick else [*todo, *seen.one_platoon(), *seen.two_platoons()]


def _baselines(seen: DisbandingEvidence) -> list[Experiment[Any]]:
    views = map(seen.under, INTERPRETATIONS)
    return [each for view in views for table in ("2.2", "2.3") for each in view.table(table, (BASELINE,))]


JUDGED: Judged[DisbandingEvidence] = Judged(CLAIMS, RULES, _behind_claims, CONDITIONS)
INTERPRETED: Exhibit[DisbandingEvidence] = Exhibit(
    "interpretations",
    "the baseline under every interpretation",
    _baselines,
    lambda seen: [baselines_table(seen)],
    baselines_data,
    given=lambda seen: seen.all_interpretations,
)
EXHIBITS: tuple[Exhibit[DisbandingEvidence], ...] = (
    _table("2.2", "one platoon disbanded"),
    _table("2.3", "two platoons disbanded"),
    Exhibit(
        "2.1fig",
        "Fig. 2.1: strings of 20, 50 and 80 platoons",
        DisbandingEvidence.figure_2_1,
        courses_tables,
        figures={"figure_2_1": plots.draw_2_1},
    ),
    Exhibit(
        "2.2.1",
        "section 2.2.1: whether a disturbance grows from platoon to platoon",
        lambda seen: (),
        stability_tables,
        stability_data,
        figures={"string_stability": draw_stability},
    ),
    Exhibit(
        "2.3fig",
        "Fig. 2.3: optimal attacks",
        DisbandingEvidence.figure_2_3,
        sweep_tables,
        sweep_data,
        figures={"figure_2_3": plots.draw_2_3},
    ),
    Exhibit(
        "tried",
        "readings tried for claims that fail",
        tried,
        tried_tables,
        tried_data,
        quick=False,
    ),
    Exhibit(
        "platoons",
        "every defender against N = 2 to 10 platoons",
        DisbandingEvidence.platoons,
        platoons_tables,
        platoons_data,
        quick=False,
    ),
    Exhibit(
        "text",
        "what the text describes and the tables leave out, with comfort, energy and recovery",
        DisbandingEvidence.readings,
        readings_tables,
        readings_data,
        quick=False,
    ),
    Exhibit("ga", "the genetic algorithm that solves (2.9)", _searches, lambda seen: [optima_table(seen)]),
    JUDGED.exhibit,
    INTERPRETED,
)


def checks(found: Reproduction[DisbandingEvidence]) -> list[Check]:
    """The cells that have a reference, those of the other interpretations included."""
    seen, cells = found.evidence, cells_of(found)
    for name in INTERPRETATIONS if seen.all_interpretations else ():
        cells += [cell for table in ("2.2", "2.3") for cell in table_cells(seen.under(name), table, (BASELINE,))]
    return cell_checks(list({(cell.table, cell.interpretation, cell.name): cell for cell in cells}.values()))


def tallies(found: Reproduction[DisbandingEvidence]) -> list[ClaimTally]:
    """How many cells of the tables and effects of mitigations are reproduced."""
    named = [(f"{cell.table} {cell.name}", cell) for cell in cells_of(found)]
    effects = ((name, cell.effect.verdict) for name, cell in named if cell.effect is not None)
    return [
        tally(found.reading, CELLS, ((name, cell.verdict) for name, cell in named)),
        tally(found.reading, EFFECTS, effects),
    ]


def document(found: Reproduction[DisbandingEvidence]) -> dict[str, Any]:
    """Plain data for JSON."""
    seen = found.evidence
    return {
        "chapter": 2,
        "interpretation": seen.interpretation,
        "quick": seen.quick,
        "parts": found.data(),
        "interpretations": INTERPRETED.data(seen) if seen.all_interpretations else {},
        "again": found.again_data(),
        "regression": {"passed": found.passed, "checks": list(map(_check, found.checks))},
        "closing": found.closing(),
    }


def _check(check: Check) -> dict[str, Any]:
    cell = check.subject.cell
    return {
        "table": cell.table,
        "interpretation": cell.interpretation,
        "cell": cell.name,
        "difference": check.difference,
        "tolerance_points": float(check.subject.row["tolerance_points"]),
        "passed": check.passed,
        "crash_agrees": check.subject.crash_agrees,
    }


CHAPTER: Chapter[DisbandingEvidence] = Chapter(
    title="chapter 2",
    evidence=DisbandingEvidence,
    reading=lambda seen: f"interpretation {seen.interpretation}",
    exhibits=EXHIBITS,
    closing=closing,
    document=document,
    checks=checks,
    judged=JUDGED,
    tallies=tallies,
)
