"""The regression check: our cells against those of our second implementation of the same specification."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from cps_baselines.disbanding.reproduction.cells import Cell


@dataclass(frozen=True)
class Reference:
    """What the reference implementation has for a cell."""

    velocity_error_percent: float
    crash: bool
    tolerance_points: float


@dataclass(frozen=True)
class Check:
    """A cell beside its reference."""

    cell: Cell
    reference: Reference

    @property
    def difference(self) -> float:
        """Ours minus the reference's, in points."""
        return self.cell.ours - self.reference.velocity_error_percent

    @property
    def passed(self) -> bool:
        """Whether the velocity error is within the tolerance, to the two digits that the reference has."""
        return round(abs(self.difference), 2) <= self.reference.tolerance_points

    @property
    def crash_agrees(self) -> bool:
        """Whether both see a collision; not part of `passed`, as rounding on another platform may flip it."""
        return self.cell.outcome.crash == self.reference.crash


def references() -> dict[tuple[str, str, str, float, float], Reference]:
    """Reference cells by table, interpretation, controller, x_d in m and tau in s."""
    text = files("cps_baselines.disbanding.reproduction").joinpath("reference.csv").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return {
        (row["table"], row["interpretation"], row["controller"], float(row["desired_gap_m"]), float(row["tau_s"])): (
            Reference(float(row["velocity_error_percent"]), row["crash"] == "yes", float(row["tolerance_points"]))
        )
        for row in csv.DictReader(lines)
    }


def check(cells: Sequence[Cell]) -> list[Check]:
    """The cells for which there is a reference."""
    known = references()
    checks = []
    for cell in cells:
        paper = cell.paper
        key = (cell.table, cell.interpretation, paper.controller, paper.desired_gap_m, paper.tau_s)
        if key in known:
            checks.append(Check(cell, known[key]))
    return checks
