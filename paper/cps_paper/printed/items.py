"""What the dissertation describes, item by item, and where it lives here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cps_paper.printed.tables import read_table

KINDS = ("command", "env", "file", "missing", "option", "policy", "preset", "reproduce")


@dataclass(frozen=True)
class Place:
    """Where something lives."""

    kind: str  # one of KINDS
    name: str  # "cps_envs/fdi/model.py", "fdi.attacked", "ch2 ga", ...; why it is missing


@dataclass(frozen=True)
class Item:
    """A figure, table, algorithm, group of equations or section."""

    chapter: int
    name: str  # "Figure 2.1", "Tables 3.1 to 3.6"
    says: str  # what it is, in a few words
    places: tuple[Place, ...]


def items() -> list[Item]:
    """All of them, in the order of the text."""
    return [_item(row) for row in read_table("items")]


def _item(row: Mapping[str, str]) -> Item:
    return Item(int(row["chapter"]), row["item"], row["says"], tuple(map(_place, row["where"].split("; "))))


def _place(text: str) -> Place:
    kind, _, name = text.partition(" ")
    if kind not in KINDS or not name:
        raise ValueError(f"{text!r} is no place: write one of {', '.join(KINDS)} and a name")
    return Place(kind, name)
