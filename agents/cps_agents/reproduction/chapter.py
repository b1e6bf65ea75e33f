"""What the commands need of a chapter that was computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

from cps_baselines.reproduction.tally import Tally


class Reproduction(Protocol):
    """What was computed for a chapter."""

    @property
    def passed(self) -> bool:
        """Whether our own numbers are still those of the reference."""
        ...

    def tallies(self) -> Sequence[Tally]:
        """How many statements got which verdict."""
        ...

    def blocks(self) -> Sequence[Any]:
        """Tables for readers."""
        ...

    def closing(self) -> Sequence[str]:
        """Paragraphs that say what is not reproduced, and why."""
        ...

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        ...

    def figures(self) -> Iterator[tuple[str, Any]]:
        """File names without suffix, and matplotlib figures."""
        ...
