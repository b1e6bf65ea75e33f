"""Tables and figures of a paper as data: the simulations behind one, and what it says in which columns."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from operator import attrgetter, getitem
from typing import Any, Generic, TypeVar

from cps_agents.sheet import Sheet
from cps_paper.evidence import Evidence, Experiment

DASH = "-"  # for what a record does not have
E = TypeVar("E", bound=Evidence)
T = TypeVar("T")


@dataclass(frozen=True)
class Column:
    """One number or word of every record."""

    heading: str
    value: str | Callable[[Any], Any]  # the name of an attribute, or a function of the record
    form: str = "{}"  # with the unit, such as "{:.2f} m"; several places take a tuple

    def shown(self, record: Any) -> str:
        """The text of a record; DASH for None."""
        found = attrgetter(self.value)(record) if isinstance(self.value, str) else self.value(record)
        if found is None:
            return DASH
        return self.form.format(*found) if isinstance(found, tuple) else self.form.format(found)


def across(
    items: Iterable[T], heading: Callable[[T], str], value: Callable[[Any, T], Any], form: str = "{}"
) -> tuple[Column, ...]:
    """A column for each item: `value` takes the record and the item."""

    def of(item: T) -> Callable[[Any], Any]:
        return lambda record: value(record, item)

    return tuple(Column(heading(item), of(item), form) for item in items)


def places(*headings: str) -> tuple[Column, ...]:
    """Columns of records that are sequences of text."""
    return across(range(len(headings)), headings.__getitem__, getitem)


@dataclass(frozen=True)
class ExhibitTable:
    """Records in columns, and what has to be said about them."""

    title: str
    columns: Sequence[Column]
    records: Sequence[Any]
    notes: Sequence[str] = ()
    left: int = 1  # so many columns of text at the left
    grouped: int = 0  # a line is drawn where one of so many columns at the left changes
    after: Sequence[int] = ()  # further rows after which one is drawn
    footer: Sequence[str] = ()  # a last row of text below a line, such as the paper's
    key: str = ""  # in JSON, where an exhibit has several tables
    data: Callable[[Any], Any] | None = None  # a record in JSON; None: the table is text only

    @property
    def sheet(self) -> Sheet:
        """The text of all records."""
        headings = [column.heading for column in self.columns]
        return Sheet(self.title, headings, self.rows, left=self.left, caption=self.notes, breaks=self.breaks)

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """The text of all records."""
        rows = [tuple(column.shown(record) for column in self.columns) for record in self.records]
        return [*rows, tuple(self.footer)] if self.footer else rows

    @property
    def breaks(self) -> list[int]:
        """The rows after which a line is drawn."""
        heads = [row[: self.grouped] for row in self.rows]
        above = {*self.after, len(self.records) - 1} if self.footer else set(self.after)
        return [k for k in range(len(heads) - 1) if heads[k] != heads[k + 1] or k in above]


@dataclass(frozen=True)
class Exhibit(Generic[E]):
    """A table, a figure or another part of a chapter that can be asked for; all functions take the evidence."""

    name: str  # what it is asked for by
    about: str
    experiments: Callable[[E], Iterable[Experiment[Any]]]
    tables: Callable[[E], Sequence[ExhibitTable]]
    document: Callable[[E], Any] | None = None  # for JSON; None: the records of the tables
    figures: Mapping[str, Callable[[E], Any]] = field(default_factory=dict)  # by file name without suffix
    quick: bool = True  # whether it is computed with --quick, unless asked for
    given: Callable[[E], bool] | None = None  # it cannot be asked for: it follows where this holds

    def data(self, evidence: E) -> Any:
        """Plain data for JSON: what `document` gives, or the records, by key where there are several tables."""
        if self.document is not None:
            return self.document(evidence)
        found = {
            each.key: [each.data(record) for record in each.records]
            for each in self.tables(evidence)
            if each.data is not None
        }
        return found.get("", found)


def with_properties(*names: str) -> Callable[[Any], dict[str, Any]]:
    """A function that gives the fields of a dataclass, and after them these properties."""
    return lambda record: {**asdict(record), **{name: getattr(record, name) for name in names}}
