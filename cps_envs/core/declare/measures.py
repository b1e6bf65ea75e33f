"""What is measured of an episode, in words: the unit of each metric and what it says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_type_hints


@dataclass(frozen=True)
class Measure:
    """A metric of an episode, stated where it is declared: `energy_kwh: Annotated[float, Measure("kWh", "...")]`."""

    unit: str  # empty for counts and marks
    says: str


def measures_of(metrics: Any) -> dict[str, Measure]:
    """The measures of a named tuple of metrics by name; those that say nothing of themselves are left out."""
    hints = get_type_hints(metrics, include_extras=True)
    return {
        name: said
        for name, hint in hints.items()
        for said in getattr(hint, "__metadata__", ())
        if isinstance(said, Measure)
    }
