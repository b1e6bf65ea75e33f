"""Tables 4.1 and 4.2: the paper's tracking errors, ours, how they compare, and the claims C24 to C28, C46, C47."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray
from cps_paper.claims import Claim, Finding, joined
from cps_paper.exhibit import Column, ExhibitTable, across
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import PERCENTS, TABLE_DAYS, TABLE_SENSORS, table_cell
from cps_paper.hvac.rules import CLAIMS, CLOSE, falling, of_printed, rising
from cps_paper.printed.tables import TrackingErrorCell, tracking_errors
from cps_paper.verdicts import ABSOLUTE, NEAR, NOT, PARTLY, REPRODUCED, Tolerance, of_cases, of_cell

CELL = (Tolerance(0.1, ABSOLUTE), Tolerance(0.10))  # a cell matches within either; chosen
CELL_RULES = "match: within 0.1 °C or 10 % of the paper's number. near: within twice that. miss: otherwise."


@dataclass(frozen=True)
class TemperaturePair:
    """A printed cell beside ours."""

    paper: TrackingErrorCell
    days: FloatArray  # (B,) ours, C

    @property
    def ours(self) -> float:
        """Over our days the mean, or over our perturbed buildings the median, C."""
        return float(self.days.mean() if self.paper.table == "4.1" else np.median(self.days))

    @property
    def difference(self) -> float:
        """Ours minus the paper's, C."""
        return self.ours - self.paper.mean_abs_error_c

    @property
    def verdict(self) -> str:
        """By CELL_RULES."""
        return of_cell(self.ours, self.paper.mean_abs_error_c, *CELL)


@dataclass(frozen=True)
class TemperatureRow:
    """The four zones under one condition and one source of temperatures."""

    cells: tuple[TemperaturePair, ...]

    @property
    def percent(self) -> int:
        """The condition."""
        return self.cells[0].paper.percent

    @property
    def sensors_used(self) -> int:
        """By the estimate; 0: the measurements."""
        return self.cells[0].paper.sensors_used

    @property
    def paper(self) -> float:
        """Mean over the zones, C."""
        return float(np.mean([cell.paper.mean_abs_error_c for cell in self.cells]))

    @property
    def ours(self) -> float:
        """Mean over the zones, in Table 4.2 its median over the buildings, C."""
        days = np.mean([cell.days for cell in self.cells], axis=0)
        return float(days.mean() if self.cells[0].paper.table == "4.1" else np.median(days))

    @property
    def spread(self) -> tuple[float, float]:
        """Quartiles of the mean over the zones over our days, C."""
        days = np.mean([cell.days for cell in self.cells], axis=0)
        low, high = np.percentile(days, [25.0, 75.0]).tolist()
        return low, high

    @property
    def verdict(self) -> str:
        """Of the mean over the zones, by CELL_RULES."""
        return of_cell(self.ours, self.paper, *CELL)


def table_rows(evidence: HvacEvidence, table: str) -> list[TemperatureRow]:
    """The rows of a table in printed order.

    Raises:
        NotRunError: the table was left out.
    """
    return [
        TemperatureRow(_row_cells(evidence, table, percent, used))
        for percent in PERCENTS[table]
        for used in range(len(TABLE_SENSORS) + 1)
    ]


def _row_cells(evidence: HvacEvidence, table: str, percent: int, used: int) -> tuple[TemperaturePair, ...]:
    errors = evidence[table_cell(table, percent, used)].mean_abs_error_c
    return tuple(
        TemperaturePair(paper, errors[:, paper.zone - 1])
        for paper in tracking_errors(table)
        if (paper.percent, paper.sensors_used) == (percent, used)
    )


def errors_table(evidence: HvacEvidence, table: str) -> ExhibitTable:
    """Table 4.1 or 4.2, a row per condition and source."""
    noise, rows = table == "4.1", table_rows(evidence, table)
    columns = (
        Column("noise" if noise else "off by", "percent", "{} %"),
        Column("sensors", lambda row: row.sensors_used or "read"),
        *across(range(1, 5), "zone {}".format, _zone, "{:.2f}/{:.2f}"),
        Column("mean", lambda row: (row.paper, row.ours), "{:.2f}/{:.2f}"),
        Column("verdict", "verdict"),
    )
    over = f"mean over {TABLE_DAYS[table]} days" if noise else f"median over {TABLE_DAYS[table]} buildings"
    spread = ", ".join(f"{row.percent} % {row.spread[0]:.1f} to {row.spread[1]:.1f}" for row in _using(rows, 0))
    notes = (
        f"Mean absolute tracking error in °C, paper/ours: {over}.",
        "sensors: as many of them as the estimate takes; read: the readings themselves, without an estimate.",
        *([] if noise else ["off by: how far A_c may be from the building's, at most; without noise."]),
        *([] if noise else [f"The middle half of our buildings, mean from readings: {spread} °C."]),
        f"Verdict of the zone mean. {CELL_RULES}",
    )
    return ExhibitTable(f"Table {table}", columns, rows, notes, left=2, grouped=1)


def errors_data(evidence: HvacEvidence, table: str) -> list[dict[str, Any]]:
    """The cells of one table for JSON; errors in C."""
    return [
        {**asdict(cell.paper), "ours": cell.ours, "difference": cell.difference, "verdict": cell.verdict}
        for row in table_rows(evidence, table)
        for cell in row.cells
    ]


def _zone(row: TemperatureRow, zone: int) -> tuple[float, float]:
    return row.cells[zone - 1].paper.mean_abs_error_c, row.cells[zone - 1].ours


WELL_C = 0.5  # the text: the controller performs well with errors "close to or below 0.5 C"


@CLAIMS.judges("C24")
def raw_under_noise(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Errors at 20 % in each zone, and their growth above it."""
    rows = _using(table_rows(evidence, "4.1"), 0)
    means = [row.ours for row in rows]
    hold = [cell.ours <= CLOSE * WELL_C for cell in rows[0].cells]
    hold += rising(means)
    shown = f"zone mean {joined(means, '.2f')} °C at {joined(PERCENTS['4.1'])} %"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("C25")
def estimates_under_noise(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Every cell of Table 4.1 that uses estimates."""
    values = [cell.ours for row in table_rows(evidence, "4.1") if row.sensors_used for cell in row.cells]
    hold = [value <= CLOSE * claim.number for value in values]
    shown = f"{sum(hold)} of {len(hold)} cells up to {CLOSE * claim.number:.2f} °C, largest {max(values):.2f} °C"
    return Finding(max(values), shown, of_cases(hold))


@CLAIMS.judges("C26", "C28")
def more_sensors_help(evidence: HvacEvidence, claim: Claim) -> Finding:
    """Under every condition, whether the zone mean falls with every further sensor."""
    table = "4.1" if claim.id == "C26" else "4.2"
    rows = table_rows(evidence, table)
    smaller = []
    for percent in PERCENTS[table]:
        means = [row.ours for row in rows if row.percent == percent and row.sensors_used]
        smaller.append(falling(means))
    hold = [all(steps) for steps in smaller]
    ends = "; ".join(f"{used}: {joined(_means(rows, used), '.2f')}" for used in (1, len(TABLE_SENSORS)))
    count = sum(map(sum, smaller))
    shown = f"smaller in {count} of {sum(map(len, smaller))} comparisons; zone mean with {ends} °C"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("C46", "C47")
def estimates_beat_readings(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The zone mean with each number of sensors against that with readings, under every condition."""
    rows = table_rows(evidence, "4.1" if claim.id == "C46" else "4.2")
    readings = {row.percent: row.ours for row in _using(rows, 0)}
    estimates = [row for row in rows if row.sensors_used]
    raw, ours = [readings[row.percent] for row in estimates], [row.ours for row in estimates]
    lower = sum(one > other for one, other in zip(raw, ours, strict=True))
    shown = f"zone mean lower in {lower} of {len(ours)} rows, up to {max(ours):.2f} °C, with readings {max(raw):.2f} °C"
    return Finding.of_comparisons(raw, ours, shown)


@CLAIMS.judges("C27")
def range_of_uncertainty(evidence: HvacEvidence, claim: Claim) -> Finding:
    """The widest range with a zone mean close to or below WELL_C, by source of temperatures."""
    rows = table_rows(evidence, "4.2")
    widest = [_widest(_using(rows, used)) for used in range(len(TABLE_SENSORS) + 1)]
    verdicts = {of_printed(each, claim) for each in widest}
    verdict = REPRODUCED if verdicts == {REPRODUCED} else PARTLY if verdicts & {REPRODUCED, NEAR} else NOT
    shown = f"{joined(widest)} % with measurements and 1 to 4 sensors; measurements {joined(_means(rows, 0), '.2f')} °C"
    return Finding(float(widest[0]), shown, verdict)


def _using(rows: Sequence[TemperatureRow], sensors_used: int) -> list[TemperatureRow]:
    return [row for row in rows if row.sensors_used == sensors_used]


def _means(rows: Sequence[TemperatureRow], sensors_used: int) -> list[float]:
    return [row.ours for row in _using(rows, sensors_used)]


def _widest(rows: Sequence[TemperatureRow]) -> int:
    """The last condition up to which all are well, in percent; 0 where the first is not."""
    widest = 0
    for row in rows:
        if row.ours > CLOSE * WELL_C:
            break
        widest = row.percent
    return widest
