"""Sheets of text for terminals, documents, files and the browser, which say everything at any width of the terminal.

Where a table is too wide, its words move to further lines. Where that is not enough, its columns go into several tables
below each other, and each of them begins with the columns that name the rows. Only a word that is wider than its
column is broken.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.text import Text

UNBROKEN = 28  # a longer word, or line of numbers, may be broken to save a column
Cell: TypeAlias = str | Sequence[tuple[str, str]]  # text, or pieces of text with the style of each
GAPS = (2, 1)  # spaces between columns: usually, and where that keeps a table in one piece


@dataclass(frozen=True)
class Part:
    """Columns of a table that fit beside each other on the console."""

    columns: Sequence[int]
    widths: Sequence[int]
    gap: int


def styled(text: str, style: str, before: str = "") -> Cell:
    """A cell with a styled text, such as "green", behind plain text."""
    return ((before, ""), (text, style))


def plain(cell: Cell) -> str:
    """The text of a cell without styles."""
    return cell if isinstance(cell, str) else "".join(text for text, _ in cell)


def csv_text(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Comma-separated values with a line of headings."""
    page = io.StringIO()
    csv.writer(page, lineterminator="\n").writerows([columns, *rows])
    return page.getvalue()


@dataclass(frozen=True)
class Sheet:
    """Text in columns: a console of rich prints it, documents take it as Markdown, files as CSV, a page as JSON."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    left: int = 1  # so many columns are text, the others are numbers
    caption: Sequence[str] = ()  # lines below the table
    breaks: Collection[int] = ()  # rows after which a line is drawn

    def markdown(self) -> list[str]:
        """The lines of the table itself, without title and caption."""
        rows = [[plain(cell).replace("\n", "<br>").replace("|", "/") for cell in row] for row in self.rows]
        lines = (f"| {' | '.join(row)} |" for row in (self.columns, *rows))
        return [next(lines), "|---" * len(self.columns) + "|", *lines]

    @property
    def csv(self) -> str:
        """The text as comma-separated values, with a line of headings."""
        return csv_text(self.columns, [list(map(plain, row)) for row in self.rows])

    def to_json(self) -> dict[str, Any]:
        """The sheet as a page in the browser takes it."""
        return {
            "title": self.title,
            "headings": list(self.columns),
            "rows": [list(map(plain, row)) for row in self.rows],
            "left": self.left,
            "notes": list(self.caption),
        }

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        """The lines for a console of this width."""
        from rich.text import Text

        if self.title:
            yield Text(self.title, style="bold")
        for part in parts(self._least(), self._most(), self._keys(), options.max_width):
            yield from self._part(console, part)
            yield Text()
        for line in self.caption:
            yield Text(line, style="dim")
        if self.caption:
            yield Text()

    @cached_property
    def _texts(self) -> list[list[Text]]:
        """The headings, then the rows."""
        from rich.text import Text

        return [
            [Text(cell) if isinstance(cell, str) else Text.assemble(*cell) for cell in row]
            for row in (self.columns, *self.rows)
        ]

    def _part(self, console: Console, part: Part) -> Iterator[Text]:
        from rich.text import Text

        rule = Text((" " * part.gap).join("─" * width for width in part.widths))
        yield from self._lines(console, part, self._texts[0], "bold")
        yield rule
        for place, row in enumerate(self._texts[1:]):
            yield from self._lines(console, part, row)
            if place in self.breaks:
                yield rule

    def _lines(self, console: Console, part: Part, row: Sequence[Text], style: str = "") -> Iterator[Text]:
        """A row as lines, each with its own piece of every cell."""
        from rich.text import Text

        shown = list(zip(part.columns, part.widths, strict=True))
        folded = [row[column].wrap(console, width, overflow="fold") for column, width in shown]
        for height in range(max(map(len, folded))):
            pieces = [lines[height] if height < len(lines) else Text() for lines in folded]
            for piece, (column, width) in zip(pieces, shown, strict=True):
                piece.rstrip()
                piece.align("left" if column < self.left else "right", width)
            line = Text(" " * part.gap).join(pieces)
            line.rstrip()
            line.stylize(style)
            yield line

    def _most(self) -> list[int]:
        """The widths at which nothing is folded."""
        return [
            max(line.cell_len for cell in column for line in cell.split("\n", allow_blank=True))
            for column in zip(*self._texts, strict=True)
        ]

    def _least(self) -> list[int]:
        """The widths at which no word of text and no line of numbers is broken."""
        return [
            max(
                _longest_word(header),
                *(
                    _longest_word(cell) if place < self.left else max(line.cell_len for line in cell.split("\n"))
                    for cell in cells
                ),
                1,
            )
            for place, (header, *cells) in enumerate(zip(*self._texts, strict=True))
        ]

    def _keys(self) -> int:
        """How many of the first columns it takes to tell the rows apart."""
        for count in range(1, self.left + 1):
            if len({tuple(map(plain, row[:count])) for row in self.rows}) == len(self.rows):
                return count
        return 1


def _longest_word(text: Text) -> int:
    from rich.cells import cell_len

    return max(map(cell_len, text.plain.split()), default=0)


def parts(least: Sequence[int], most: Sequence[int], keys: int, width: int) -> list[Part]:
    """How columns of these widths are laid out in `width`: the fewest parts, each with the first `keys` columns."""
    made = [_parts(least, most, keys, width, gap) for gap in GAPS]
    return min(made, key=len)


def _parts(least: Sequence[int], most: Sequence[int], keys: int, width: int, gap: int) -> list[Part]:
    share = max((width - keys * gap) // (keys + 1), 1)  # of each column where a part has a single one beside its keys
    names = [min(each, share) for each in least[:keys]]
    room = min(max(width - sum(names) - keys * gap, 1), UNBROKEN)
    least = [*names, *(min(each, room) for each in least[keys:])]
    groups: list[list[int]] = [list(range(keys))]
    for column in range(keys, len(least)):
        if len(groups[-1]) > keys and sum(least[each] + gap for each in [*groups[-1], column]) - gap > width:
            groups.append(list(range(keys)))
        groups[-1].append(column)
    return [
        Part(group, fit([least[i] for i in group], [most[i] for i in group], width - gap * (len(group) - 1)), gap)
        for group in groups
    ]


def fit(least: Sequence[int], most: Sequence[int], room: int) -> list[int]:
    """Widths that sum to at most `room` where `least` allows it: the widest columns give way first."""
    widths = [max(pair) for pair in zip(least, most, strict=True)]
    while sum(widths) > max(room, sum(least)):
        widest = max((i for i, width in enumerate(widths) if width > least[i]), key=lambda i: widths[i])
        widths[widest] -= 1
    return widths
