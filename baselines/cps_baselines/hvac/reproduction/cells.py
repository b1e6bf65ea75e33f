"""Tables 4.1 and 4.2: the paper's mean absolute tracking errors, ours, and how they compare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_baselines.hvac.reproduction.experiments import PERCENTS, TABLE_SENSORS, table_cell
from cps_baselines.paper.temperatures import TrackingErrorCell, tracking_errors
from cps_baselines.reproduction.evidence import Evidence
from cps_envs.core.types import FloatArray

SAME_C, SAME_SHARE = 0.1, 0.10  # a cell matches within either; chosen
NEAR = 2.0  # times these
MATCH, CLOSE, MISS = "match", "near", "miss"
CELL_RULES = "match: within 0.1 °C or 10 % of the paper's number. near: within twice that. miss: otherwise."


@dataclass(frozen=True)
class Cell:
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
        return agreement(self.ours, self.paper.mean_abs_error_c)


@dataclass(frozen=True)
class Row:
    """The four zones under one condition and one source of temperatures."""

    cells: tuple[Cell, ...]

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
        return agreement(self.ours, self.paper)


def agreement(ours: float, paper: float) -> str:
    """`match`, `near` or `miss`."""
    allowed = max(SAME_C, SAME_SHARE * paper)
    distance = abs(ours - paper)
    return MATCH if distance <= allowed else CLOSE if distance <= NEAR * allowed else MISS


def table_rows(evidence: Evidence, table: str) -> list[Row]:
    """The rows of a table in printed order.

    Raises:
        NotRunError: the table was left out.
    """
    return [
        Row(_row_cells(evidence, table, percent, used))
        for percent in PERCENTS[table]
        for used in range(len(TABLE_SENSORS) + 1)
    ]


def _row_cells(evidence: Evidence, table: str, percent: int, used: int) -> tuple[Cell, ...]:
    errors = evidence[table_cell(table, percent, used)].mean_abs_error_c
    return tuple(
        Cell(paper, errors[:, paper.zone - 1])
        for paper in tracking_errors(table)
        if (paper.percent, paper.sensors_used) == (percent, used)
    )
