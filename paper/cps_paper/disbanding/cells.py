"""Tables 2.2 and 2.3, cell by cell: the paper's number, ours, and how they compare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import Any

import numpy as np

from cps_envs.disbanding.config import INTERPRETATIONS
from cps_paper.claims import findings_document
from cps_paper.disbanding.experiments import DisbandingEvidence
from cps_paper.disbanding.rules import CLAIMS
from cps_paper.disbanding.scenario import CONTROLLERS, ScenarioOutcome
from cps_paper.exhibit import Column, ExhibitTable, places
from cps_paper.printed.tables import POINTS, VelocityErrorCell, velocity_errors
from cps_paper.verdicts import (
    ABSOLUTE,
    MATCH,
    MISS,
    NEAR,
    NOT,
    REPRODUCED,
    Check,
    Reference,
    Tolerance,
    of_cell,
    of_number,
    shipped_rows,
)

BASELINE = CONTROLLERS[0]
AVERAGED = {"2.2": "intact", "2.3": "all"}  # over which vehicles the paper seems to average; inferred


@dataclass(frozen=True)
class Effect:
    """What a mitigation changes: its E_v minus the baseline's in the same setting, in points."""

    ours: float
    paper: float

    @property
    def verdict(self) -> str:
        """By the common rule for numbers."""
        return of_number(self.ours, self.paper)


@dataclass(frozen=True)
class VelocityErrorPair:
    """One cell of Table 2.2 or 2.3 beside ours."""

    table: str
    interpretation: str
    paper: VelocityErrorCell
    outcome: ScenarioOutcome
    baseline: VelocityErrorPair | None = None  # the same setting without a mitigation; None in the baseline itself

    @property
    def averages(self) -> dict[str, float]:
        """E_v in percent by averaging set."""
        return {"intact": self.outcome.velocity_error_intact, "all": self.outcome.velocity_error_all}

    @property
    def ours(self) -> float:
        """E_v in percent over the set that the table's numbers fit."""
        return self.averages[AVERAGED[self.table]]

    @property
    def difference(self) -> float:
        """Ours minus the paper's, in points."""
        return self.ours - self.paper.velocity_error_percent

    @property
    def effect(self) -> Effect | None:
        """Of the mitigation; None in the baseline. It may be far off where E_v itself matches."""
        if self.baseline is None:
            return None
        before = self.baseline
        return Effect(self.ours - before.ours, self.paper.velocity_error_percent - before.paper.velocity_error_percent)

    @property
    def verdict(self) -> str:
        """`match`, `near` or `miss`."""
        return of_cell(self.ours, self.paper.velocity_error_percent, POINTS)

    @property
    def crash_agrees(self) -> bool:
        """Whether both see a collision, or both see none."""
        return self.outcome.crash == self.paper.crash

    @property
    def name(self) -> str:
        """Where it stands, without the table."""
        return f"{self.paper.controller} ({self.paper.desired_gap_m:g} m, {self.paper.tau_s:g} s)"


def table_cells(
    evidence: DisbandingEvidence, table: str, controllers: Sequence[str] = CONTROLLERS
) -> list[VelocityErrorPair]:
    """The cells of a table in printed order, controller by controller."""
    printed = velocity_errors(f"table_{table.replace('.', '_')}")
    baselines = {_setting(paper): _cell(evidence, table, paper) for paper in printed if paper.controller == BASELINE}
    return [
        baselines[_setting(paper)]
        if controller == BASELINE
        else replace(_cell(evidence, table, paper), baseline=baselines[_setting(paper)])
        for controller in controllers
        for paper in printed
        if paper.controller == controller
    ]


def _cell(evidence: DisbandingEvidence, table: str, paper: VelocityErrorCell) -> VelocityErrorPair:
    outcome = evidence[evidence.cell(table, paper.controller, *_setting(paper))]
    return VelocityErrorPair(table, evidence.interpretation, paper, outcome)


def _setting(paper: VelocityErrorCell) -> tuple[float, float]:
    return paper.desired_gap_m, paper.tau_s


def mean_distance(cells: Sequence[VelocityErrorPair], averaged: str | None = None) -> float:
    """Mean absolute difference from the paper in points, over the table's own or a given averaging set."""
    values = [cell.averages[averaged or AVERAGED[cell.table]] - cell.paper.velocity_error_percent for cell in cells]
    return float(np.mean(np.abs(values)))


def cells_tables(evidence: DisbandingEvidence, table: str) -> list[ExhibitTable]:
    """A table of velocity errors cell by cell, and its means."""
    cells, averaged = table_cells(evidence, table), AVERAGED[table]
    other = "all" if averaged == "intact" else "intact"
    columns = (*COLUMNS, Column(other, lambda cell: cell.averages[other], "{:.2f}"))
    title = f"Table {table}: E_v in percent over {SETS[averaged]}, {evidence.interpretation}"
    return [
        ExhibitTable(title, columns, cells, (CELL_NOTE.format(other=SETS[other]),), left=3, grouped=1),
        ExhibitTable(f"Table {table}: mean absolute difference from the paper in points", MEANS, by_controller(cells)),
    ]


def by_controller(cells: Sequence[VelocityErrorPair]) -> list[list[VelocityErrorPair]]:
    """The rows of a table."""
    return [list(group) for _, group in groupby(cells, key=lambda cell: cell.paper.controller)]


def cells_data(cells: Sequence[VelocityErrorPair]) -> dict[str, Any]:
    """The cells of one table, velocity errors in percent, and their mean distances from the paper, for JSON."""
    return {
        "averaged_over": AVERAGED[cells[0].table],
        "cells": list(map(_data, cells)),
        "mean_absolute_difference": {
            row[0].paper.controller: {averaged: mean_distance(row, averaged) for averaged in SETS}
            for row in by_controller(cells)
        },
    }


def baselines_table(evidence: DisbandingEvidence) -> ExhibitTable:
    """The baseline of both tables, and the claims about its collisions, under every interpretation."""
    rows = []
    for table, claim in BASELINE_CLAIMS.items():
        for name in INTERPRETATIONS:
            there = evidence.under(name)
            cells = table_cells(there, table, (BASELINE,))
            values = [f"{cell.ours:.2f}" for cell in cells]
            flags = "".join("Y" if cell.outcome.crash else "N" for cell in cells)
            verdict = CLAIMS.evaluate(there, (claim,))[0][1].verdict
            rows.append((table, name, *values, flags, f"{mean_distance(cells):.2f}", f"{claim} {verdict}"))
    names = [f"{cell.paper.desired_gap_m:g}, {cell.paper.tau_s:g}" for cell in cells]
    columns = places("Table", "", *names, "crash", "mean diff.", "claim")
    title = "Baseline under every interpretation: E_v in percent at (x_d in m, tau in s)"
    return ExhibitTable(title, columns, rows, left=2, grouped=1)


def baselines_data(evidence: DisbandingEvidence) -> dict[str, Any]:
    """The same by interpretation, for JSON."""
    views = {name: evidence.under(name) for name in INTERPRETATIONS}
    return {
        name: {
            "tables": {table: cells_data(table_cells(there, table, (BASELINE,))) for table in BASELINE_CLAIMS},
            "claims": findings_document(CLAIMS.evaluate(there, tuple(BASELINE_CLAIMS.values()))),
        }
        for name, there in views.items()
    }


@lru_cache(maxsize=1)
def references() -> Mapping[tuple[str, str, str, float, float], dict[str, str]]:
    """The rows of `reference.csv` by table, interpretation, controller, x_d in m and tau in s."""
    return {
        (row["table"], row["interpretation"], row["controller"], float(row["desired_gap_m"]), float(row["tau_s"])): row
        for row in shipped_rows("cps_paper.disbanding")
    }


def checks(cells: Sequence[VelocityErrorPair]) -> list[Check]:
    """The cells for which there is a reference, to the two digits that it has; crash flags are not part of it."""
    known, made = references(), []
    for cell in cells:
        paper = cell.paper
        row = known.get((cell.table, cell.interpretation, paper.controller, paper.desired_gap_m, paper.tau_s))
        if row is not None:
            tolerance = Tolerance(float(row["tolerance_points"]) + HALF_DIGIT, ABSOLUTE)
            reference = Reference(float(row["velocity_error_percent"]), tolerance)
            made.append(Check(f"{cell.table} {cell.name}", cell.ours, reference, Pair(cell, row)))
    return made


@dataclass(frozen=True)
class Pair:
    """A cell and the row of the reference."""

    cell: VelocityErrorPair
    row: Mapping[str, str]

    @property
    def crash_agrees(self) -> bool:
        """Whether both see a collision; rounding on another platform may flip it."""
        return self.cell.outcome.crash == (self.row["crash"] == "yes")


def _data(cell: VelocityErrorPair) -> dict[str, Any]:
    effect, outcome = cell.effect, cell.outcome
    return {
        **asdict(cell.paper),
        "velocity_error_percent": {"paper": cell.paper.velocity_error_percent, "ours": cell.ours, **cell.averages},
        "difference": cell.difference,
        "verdict": cell.verdict,
        "effect": None if effect is None else {**asdict(effect), "verdict": effect.verdict},
        "crash": {"paper": cell.paper.crash, "ours": outcome.crash, "agrees": cell.crash_agrees},
        "collided": int(outcome.collided.sum()),
        "rear_collided": int(outcome.rear_collided.sum()),
        "stopped_intact": int((outcome.stops[outcome.intact] > 0).sum()),
    }


def _counts(words: Sequence[str], kinds: Sequence[str]) -> str:
    return " / ".join(str(words.count(word)) for word in kinds)


def _effects(row: Sequence[VelocityErrorPair]) -> str | None:
    words = [cell.effect.verdict for cell in row if cell.effect is not None]
    return _counts(words, (REPRODUCED, NEAR, NOT)) if words else None


def _crash(cell: VelocityErrorPair) -> tuple[str, str, str]:
    words = ["yes" if flag else "no" for flag in (cell.paper.crash, cell.outcome.crash)]
    return words[0], words[1], "" if cell.crash_agrees else "*"


HALF_DIGIT = 0.005  # the reference has two
BASELINE_CLAIMS = {"2.2": "P29", "2.3": "P39"}  # about its collisions
SETS = {"intact": "vehicles never disbanded", "all": "all vehicles"}
CELL_NOTE = (
    "Crash: the paper's flag / ours, * where they differ. mpc: one set of weights for all cells, tuned on the mpc "
    "column of Table 2.2. Effect: of the mitigation on E_v in points, against the baseline of the same setting, ours / "
    "paper; reproduced within 5 %, near within 10 %. Last column: E_v averaged over {other}, see the means below."
)
COLUMNS = (
    Column("", "paper.controller"),
    Column("x_d", "paper.desired_gap_m", "{:g} m"),
    Column("tau", "paper.tau_s", "{:g} s"),
    Column("paper", "paper.velocity_error_percent", "{:.2f}"),
    Column("ours", "ours", "{:.2f}"),
    Column("diff.", "difference", "{:+.2f}"),
    Column("verdict", "verdict"),
    Column("effect", lambda cell: cell.effect and (cell.effect.ours, cell.effect.paper), "{:+.1f} / {:+.1f}"),
    Column("its verdict", lambda cell: cell.effect.verdict if cell.effect else ""),
    Column("crash", _crash, "{}/{}{}"),
)
MEANS = (  # of the cells of a controller
    Column("", lambda row: row[0].paper.controller),
    Column("over intact", lambda row: mean_distance(row, "intact"), "{:.2f}"),
    Column("over all", lambda row: mean_distance(row, "all"), "{:.2f}"),
    Column("match / near / miss", lambda row: _counts([cell.verdict for cell in row], (MATCH, NEAR, MISS))),
    Column("effect: same / near / not", _effects),
    Column("same crash flag", lambda row: (sum(cell.crash_agrees for cell in row), len(row)), "{} of {}"),
)
