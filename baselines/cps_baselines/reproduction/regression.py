"""The regression check: our numbers against those of our second implementation of the same specification."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from cps_baselines.reproduction.verdicts import Tolerance

NO_SUPPORT = (
    "Both programs are ours and share a specification and its parameters: agreement shows that the simulation is the "
    "same, and supports nothing that the paper says."
)
NO_FINDING = "The simulation has changed; this is no finding about the paper."


@dataclass(frozen=True)
class Reference:
    """What the second implementation has, and how near our number has to come."""

    value: float
    tolerance: Tolerance
    recorded: float | None = None  # ours, where it was outside when the file was made
    reason: str = ""  # why


@dataclass(frozen=True)
class Check:
    """A number of ours beside its reference."""

    label: str
    ours: float
    reference: Reference
    subject: Any = None  # whose number it is

    @property
    def difference(self) -> float:
        """Ours minus the reference's."""
        return self.ours - self.reference.value

    @property
    def inside(self) -> bool:
        """Whether ours lies within the tolerance of the reference."""
        return self.reference.tolerance.admits(self.ours, self.reference.value)

    @property
    def passed(self) -> bool:
        """Whether it is inside, or where it was recorded as being outside, still what it was."""
        recorded = self.reference.recorded
        return self.inside or (recorded is not None and self.reference.tolerance.admits(self.ours, recorded))


def failures(lines: Iterable[str]) -> str:
    """A sentence on the checks that failed; empty without any."""
    named = "; ".join(lines)
    return f" FAILED: {named}. {NO_FINDING}" if named else ""


def shipped_rows(package: str, name: str = "reference") -> list[dict[str, str]]:
    """The rows of `<name>.csv` in a package; lines that start with # explain them."""
    text = files(package).joinpath(f"{name}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
