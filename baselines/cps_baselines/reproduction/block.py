"""A table of text, ready for a terminal or a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Block:
    """A table and what has to be said about it."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: int = 1  # so many columns of text at the left
    notes: Sequence[str] = ()
    breaks: Sequence[int] = ()  # rows after which a line is drawn

    @property
    def headings(self) -> Sequence[str]:
        """Those of the columns."""
        return self.columns
