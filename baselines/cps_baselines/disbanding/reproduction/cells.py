"""Tables 2.2 and 2.3, cell by cell: the paper's number, ours, and how they compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.disbanding.reproduction.scenario import CONTROLLERS, Outcome
from cps_baselines.paper.agreement import verdict
from cps_baselines.paper.tables import VelocityErrorCell, velocity_errors
from cps_baselines.reproduction.verdicts import of_number

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
class Cell:
    """One cell of Table 2.2 or 2.3 beside ours."""

    table: str
    interpretation: str
    paper: VelocityErrorCell
    outcome: Outcome
    baseline: Cell | None = None  # the same setting without a mitigation; None in the baseline itself

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
        return verdict(self.difference)

    @property
    def crash_agrees(self) -> bool:
        """Whether both see a collision, or both see none."""
        return self.outcome.crash == self.paper.crash

    @property
    def name(self) -> str:
        """Where it stands, without the table."""
        return f"{self.paper.controller} ({self.paper.desired_gap_m:g} m, {self.paper.tau_s:g} s)"


def table_cells(evidence: Evidence, table: str, controllers: Sequence[str] = CONTROLLERS) -> list[Cell]:
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


def _cell(evidence: Evidence, table: str, paper: VelocityErrorCell) -> Cell:
    experiments = evidence.experiments
    outcome = evidence[experiments.cell(table, paper.controller, *_setting(paper))]
    return Cell(table, experiments.interpretation, paper, outcome)


def _setting(paper: VelocityErrorCell) -> tuple[float, float]:
    return paper.desired_gap_m, paper.tau_s


def mean_distance(cells: Sequence[Cell], averaged: str | None = None) -> float:
    """Mean absolute difference from the paper in points, over the table's own or a given averaging set."""
    values = [cell.averages[averaged or AVERAGED[cell.table]] - cell.paper.velocity_error_percent for cell in cells]
    return float(np.mean(np.abs(values)))
