"""The regression check: our numbers against those of our second implementation of the same specification."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from cps_baselines.hvac.reproduction.measures import Measure

ABSOLUTE, SHARE, FACTOR = "absolute", "share", "factor"  # kinds of tolerance


@dataclass(frozen=True)
class Reference:
    """What the reference implementation has, and how near our number has to come."""

    value: float
    kind: str  # one of ABSOLUTE, SHARE, FACTOR
    tolerance: float
    recorded: float | None = None  # ours, where it was outside when this file was made
    reason: str = ""  # why

    def admits(self, ours: float, around: float) -> bool:
        """Whether a number of ours lies within the tolerance of a value."""
        if self.kind == FACTOR:
            return around / self.tolerance <= ours <= around * self.tolerance
        return abs(ours - around) <= self.tolerance * (abs(around) if self.kind == SHARE else 1.0)

    @property
    def shown(self) -> str:
        """The tolerance with its unit."""
        if self.kind == FACTOR:
            return f"factor {self.tolerance:g}"
        return f"{100.0 * self.tolerance:g} %" if self.kind == SHARE else f"{self.tolerance:g}"


@dataclass(frozen=True)
class Check:
    """A number of ours beside its reference."""

    measure: Measure
    reference: Reference

    @property
    def name(self) -> str:
        """Which number it is."""
        return f"{self.measure.group}: {self.measure.case}"

    @property
    def inside(self) -> bool:
        """Whether it lies within the tolerance of the reference."""
        return self.reference.admits(self.measure.value, self.reference.value)

    @property
    def passed(self) -> bool:
        """Whether it is inside, or where it was recorded as being outside, still what it was."""
        recorded = self.reference.recorded
        return self.inside or (recorded is not None and self.reference.admits(self.measure.value, recorded))


def references() -> dict[tuple[str, str], Reference]:
    """References by group and case."""
    text = files("cps_baselines.hvac.reproduction").joinpath("reference.csv").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return {
        (row["group"], row["case"]): Reference(
            float(row["value"]),
            row["kind"],
            float(row["tolerance"]),
            float(row["recorded"]) if row["recorded"] else None,
            row["reason"],
        )
        for row in csv.DictReader(lines)
    }


def check(found: Sequence[Measure]) -> list[Check]:
    """The numbers for which there is a reference."""
    known = references()
    return [Check(each, known[each.group, each.case]) for each in found if (each.group, each.case) in known]
